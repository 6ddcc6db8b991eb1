# wellspaced, and the command line tool beside it.
#
#   docker build -t wellspace .
#   docker run --rm --read-only --cap-drop ALL -v wellspace:/var/lib/wellspace -p 127.0.0.1:7233:7233 wellspace
#
# deploy/compose.yaml runs it with Prometheus and Grafana.
FROM debian:bookworm-slim AS build
COPY deploy/install-deps.sh /usr/src/wellspace/deploy/
RUN /usr/src/wellspace/deploy/install-deps.sh build
COPY . /usr/src/wellspace
WORKDIR /usr/src/wellspace
RUN cmake --preset release -DWELLSPACE_TESTS=OFF \
 && cmake --build --preset release \
 && scripts/third_party --copy /usr/src/wellspace/third_party \
 && strip build/release/bin/wellspace build/release/bin/wellspaced

FROM debian:bookworm-slim
COPY deploy/install-deps.sh /tmp/
# Licences stay: those of shared libraries where Debian has them, those of what is compiled in beside Wellspace's own.
RUN printf 'path-exclude /usr/share/%s/*\n' doc man locale > /etc/dpkg/dpkg.cfg.d/small \
 && echo 'path-include /usr/share/doc/*/copyright' >> /etc/dpkg/dpkg.cfg.d/small \
 && /tmp/install-deps.sh runtime && rm -rf /tmp/install-deps.sh /var/lib/apt/lists/* /var/cache/apt/* \
 && useradd --system --uid 7233 --no-create-home --shell /usr/sbin/nologin wellspace \
 && install --directory --owner 7233 --group 7233 --mode 0700 /var/lib/wellspace
COPY LICENSE README.md THIRD_PARTY.md /usr/share/doc/wellspace/
COPY --from=build /usr/src/wellspace/third_party /usr/share/doc/wellspace/third_party/
COPY --from=build /usr/src/wellspace/build/release/bin/wellspace /usr/src/wellspace/build/release/bin/wellspaced /usr/local/bin/
USER 7233
# Sessions. A volume with a name outlives the container; --ephemeral in the place of --data keeps none.
VOLUME /var/lib/wellspace
EXPOSE 7233 9464
STOPSIGNAL SIGTERM
# Of the tool, for `docker exec` and the health check, which asks the health service of gRPC: it is there without --metrics-listen.
ENV WELLSPACE_SERVER=127.0.0.1:7233
HEALTHCHECK --interval=30s --timeout=5s --start-period=10s CMD ["wellspace", "server", "health"]
ENTRYPOINT ["wellspaced"]
# A container is reached through its own address, never through its loopback: publish the port to the loopback of the host, as above, or to
# a private network; for others, mount certificates and tokens (docs/security.md) and name them in the place of --insecure-remote.
# `docker stop` kills after ten seconds; work has ended before that, or goes on with the next start.
CMD ["--listen", "0.0.0.0:7233", "--insecure-remote", "--grace", "8", "--data", "/var/lib/wellspace"]
