# docker build -t cutsim .
# docker run -it --rm -v "$PWD/results:/cutsim/results" cutsim make demo NAME=dcb
FROM debian:13-slim
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates make
WORKDIR /cutsim
COPY . .
RUN make setup && rm -rf /var/lib/apt/lists/* /root/.cache
CMD ["make", "demo"]
