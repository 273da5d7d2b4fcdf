# flexura with everything that is optional:
#   docker build -t flexura .
#   docker run --rm --user "$(id -u)" -v "$PWD:/work" flexura modes guide.yaml
#   docker run --rm --user "$(id -u)" --network host -v "$PWD:/work" flexura live guide.yaml --no-browser --keep
# CalculiX (GPL 2) and Intel MKL (not open source) are inside: an image that is given on falls under their
# licences too; docs/releasing.md says which. `--build-arg EXTRAS=` leaves out what is optional.
FROM python:3.13-slim-bookworm AS built
RUN pip install --no-cache-dir build
COPY . /source
RUN python -m build --outdir /dist /source

FROM python:3.13-slim-bookworm
ARG EXTRAS=[all]
# a second solver, and a compiler for FMUs
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends gcc libc6-dev calculix-ccx \
 && rm -rf /var/lib/apt/lists/*
RUN --mount=from=built,source=/dist,target=/dist pip install --no-cache-dir "$(ls /dist/*.whl)${EXTRAS}"
# whoever runs it owns what is written; caches are those of a run
ENV HOME=/tmp
USER 1000
WORKDIR /work
ENTRYPOINT ["flexura"]
CMD ["--help"]
