# # Friction makes heat
#
# Two steel blocks of 10 × 10 × 10 mm lie on each other.  They are pressed together, and the upper one is pushed by 1 mm
# over the lower one.  The work of friction becomes heat, which flows into both blocks.  All other surfaces are
# insulated, so that every millijoule can be found again.
#
# ## How much heat, and how hot?
#
# At the pressure $p$, with the friction coefficient $\mu$ and the speed $v$, a unit of area of the interface generates
# the heat $D = \mu p v$ per time.  After the faces have slipped by $s$, the mean temperature of the blocks has risen by
#
# $$ \Delta\bar T = \frac{\mu p\,s\,A}{\sum m c} . $$
#
# The faces are hotter than that.  Where the pressure is the same everywhere, the temperature depends on the height
# only.  The mean of the two faces is then that of a slab of the thickness $h$ with the flux $D/2$ on one face (Carslaw
# and Jaeger 1959, §3.8):
#
# $$ \frac{T^+ + T^-}{2} = \frac{D h}{2 k}\left[F + \frac13 - \frac{2}{\pi^2}\sum_n \frac{e^{-n^2\pi^2 F}}{n^2}\right],
#    \qquad F = \frac{k t}{\rho c h^2} . $$
#
# The faces differ in temperature, because the heat has to pass the contact: each side conducts $\gamma^\pm p$ per area
# and takes a part of $D$ in this proportion, here three quarters and one quarter.
#
# Before they slip, the faces stick: the penalty $\varepsilon_T$ that holds them lets them give by
# $\mu p/\varepsilon_T$, here 0.001 mm, over which no heat is generated.

import sys

import numpy as np
from mpi4py import MPI

steps = 10 if "--quick" in sys.argv else 20  # of the motion
h, stroke, speed, pressure = 10.0, 1.0, 10.0, 100.0  # mm, mm, mm/s, MPa
rho, c, k = 7.85e-9, 4.6e8, 50.0  # t/mm³, mJ/(t K), mW/(mm K)
mu, penalty = 0.1, 1e4  # –, MPa/mm

# In the first step the blocks are pressed together.  Then the upper one moves, and soon the faces slip.

start, end = np.array([1, 1 + steps]) * stroke / speed / steps
slip = start + mu * pressure / penalty / speed

# ## Mesh, displacement, temperature
#
# The geometry `blocks` comes with cutsim.  The blocks meet in the group `crack`, where both unknowns may jump.

from cutsim import State, Temperature, cracked_space, geometry, read_geo

domain = read_geo(geometry("blocks"), MPI.COMM_WORLD, dict(B=h, H=h, L=h, nx=1, ly=0.1, growth=1.1))
facets, lower, upper = domain.facets("crack"), domain.cells("lower"), domain.cells("upper")
state = State(cracked_space(domain.mesh, ("Lagrange", 1, (3,)), facets))
temperature = Temperature(state, cracked_space(domain.mesh, ("Lagrange", 1), facets), 0.0, absolute_zero=-273.15)

# ## Mechanics
#
# The interface is a crack without a bond: contact, with Coulomb's friction.  To have the same pressure everywhere, the
# lower block is fixed at every node, and the upper one sits in a holder that leaves it free to be compressed only.

from cutsim import Coulomb, Crack, LinearElastic, Mechanics, Solid, Support

steel = LinearElastic(young=210e3, poisson=0.3)  # MPa
body = Solid(state, steel, density=rho)
rubbing = Coulomb(mu, stiffness=penalty)
crack = Crack(state, facets, lower, young=steel.young, name="contact", normal="reference", friction=rubbing)
depth = pressure * (h / (steel.bulk + 4 / 3 * steel.shear) + 1 / crack.contact.stiffness)
drive = Support(state, upper, 0, lambda t: speed * max(t - start, 0.0), dim=3, corners=(start, slip))
press = Support(state, domain.facets("top"), 1, lambda t: -depth * min(t / start, 1.0), name="press")
holder = [Support(state, upper, 2, dim=3), *(Support(state, lower, axis, dim=3) for axis in range(3))]
mechanics = Mechanics(state, [body, crack], [drive, press, *holder])

# ## Heat
#
# Each block conducts.  `InterfaceHeat` lets the friction heat of the crack flow into both faces, and exchanges heat
# between them.  In each step mechanics and heat are solved in turn.

from cutsim import ContactHeat, HeatBody, HeatTransfer, InterfaceHeat, ThermoMechanics

properties = dict(capacity=c, conductivity=k, density=rho)
blocks = [HeatBody(temperature, body=cells, name=n, **properties) for n, cells in (("lower", lower), ("upper", upper))]
contact = InterfaceHeat(temperature, crack, ContactHeat(0.6, 0.2), name="interface")  # γ⁺, γ⁻ [mW/(N K)]
problem = ThermoMechanics(mechanics, HeatTransfer(temperature, [*blocks, contact]))

# ## Run
#
# The temperatures of the two faces, means over the points of the contact, are added to the history.

from cutsim import Curve, Recording, StepControl, plot_curves, run

mean, value = crack.points.integral, contact.exchange.point_values
faces = ("temperature_plus", "temperature_minus")  # lower, upper
control = StepControl(first=slip - start, largest=start, growth=2.0, easy=20)
options = dict(extra=lambda _: {face: (mean(value(face)) / h**2, "temperature") for face in faces}, overwrite=True)
with Recording("results/frictional_heating", problem, end, title="rubbing", **options) as recording:
    run(problem, end, control, recording)

# ## Compare
#
# All heat is found again, to rounding.  How well the temperature of the faces is met depends on the steps.

history = recording.columns()
time, lower_face, upper_face = history["time"], *(history[face] for face in faces)
rise = (history["lower_temperature"] + history["upper_temperature"]) / 2
F = k / (rho * c * h**2) * np.maximum(time - slip, 0)
decay = sum(np.exp(-((n * np.pi) ** 2) * F) / n**2 for n in range(1, 2000))
theory = mu * pressure * speed * h / (2 * k) * np.where(F > 0, F + 1 / 3 - 2 / np.pi**2 * decay, 0)
result = {
    "heat_over_work_of_friction": 2 * rho * c * h**3 * rise[-1] / history["energy_friction"][-1],
    "mean_rise": rise[-1],
    "mean_rise_of_theory": mu * pressure * speed * (end - slip) / (2 * rho * c * h),
    "lower_face": lower_face[-1],
    "upper_face": upper_face[-1],
    "faces_over_theory": (lower_face[-1] + upper_face[-1]) / (2 * theory[-1]),
}
recording.summary(result)
if MPI.COMM_WORLD.rank == 0:
    print(*(f"{name}: {value:.6g}" for name, value in result.items()), sep="\n")
    curves = [Curve(time, (lower_face + upper_face) / 2, "faces", "o"), Curve(time, theory, "faces, series")]
    file, labels = "results/frictional_heating/faces.png", dict(xlabel="time [s]", ylabel="temperature rise [K]")
    plot_curves(file, [*curves, Curve(time, rise, "blocks, mean")], title="Steel on steel", **labels)
assert abs(result["heat_over_work_of_friction"] - 1) < 1e-6 and abs(result["faces_over_theory"] - 1) < 0.02
assert abs(result["mean_rise"] / result["mean_rise_of_theory"] - 1) < 1e-6
