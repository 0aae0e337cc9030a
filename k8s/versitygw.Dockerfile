# An S3 server over a folder (Apache-2.0). Build: docker build -f k8s/versitygw.Dockerfile -t fullwell-versitygw k8s
FROM golang:1.26-bookworm AS build
ARG VERSITYGW_VERSION=v1.8.0
RUN CGO_ENABLED=0 GOBIN=/out go install -trimpath github.com/versity/versitygw/cmd/versitygw@${VERSITYGW_VERSION}

FROM debian:bookworm-slim
RUN groupadd --gid 10001 versitygw \
    && useradd --uid 10001 --gid 10001 --no-create-home --shell /usr/sbin/nologin versitygw \
    && install -d -o versitygw -g versitygw /srv/objects
COPY --from=build /out/versitygw /usr/local/bin/versitygw
USER 10001:10001
VOLUME /srv/objects
EXPOSE 7070
# The keys come from ROOT_ACCESS_KEY and ROOT_SECRET_KEY; without them it does not start.
HEALTHCHECK --interval=10s --timeout=5s --start-period=5s --retries=6 \
    CMD ["bash", "-c", "exec 3<>/dev/tcp/127.0.0.1/7070 && printf 'GET /health HTTP/1.0\\r\\n\\r\\n' >&3 && head -1 <&3 | grep -q ' 200'"]
ENTRYPOINT ["versitygw", "--port", ":7070", "--health", "/health", "--quiet"]
CMD ["posix", "/srv/objects"]
