# wellspaced, and the command line tool beside it.
#
#   docker build -t wellspace .
#   docker run --rm -p 127.0.0.1:7233:7233 wellspace
FROM debian:bookworm-slim AS build
COPY deploy/install-deps.sh /usr/src/wellspace/deploy/
RUN /usr/src/wellspace/deploy/install-deps.sh build
COPY . /usr/src/wellspace
WORKDIR /usr/src/wellspace
RUN cmake --preset release -DWELLSPACE_TESTS=OFF \
 && cmake --build --preset release \
 && strip build/release/bin/wellspace build/release/bin/wellspaced

FROM debian:bookworm-slim
COPY deploy/install-deps.sh /tmp/
RUN /tmp/install-deps.sh runtime && rm -rf /tmp/install-deps.sh /var/lib/apt/lists/* \
 && useradd --system --no-create-home --shell /usr/sbin/nologin wellspace
COPY LICENSE README.md /usr/share/doc/wellspace/
COPY --from=build /usr/src/wellspace/build/release/bin/wellspace /usr/src/wellspace/build/release/bin/wellspaced /usr/local/bin/
USER wellspace
EXPOSE 7233
STOPSIGNAL SIGTERM
ENTRYPOINT ["wellspaced"]
# A container is reached through its own address, never through its loopback. The server has no transport security of its own here:
# publish the port to the loopback of the host, as above, or to a private network, or put a proxy with TLS in front.
CMD ["--listen", "0.0.0.0:7233", "--insecure-remote"]
