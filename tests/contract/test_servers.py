"""The servers that other tests rely on start, answer and are empty."""

import socket

from servers import S3Server, ValkeyServer


def test_the_s3_server_takes_and_gives_an_object(s3_server: S3Server) -> None:
    import io

    from minio import Minio

    client = Minio(s3_server.endpoint, access_key=s3_server.access_key, secret_key=s3_server.secret_key, secure=False)
    client.make_bucket("server-test")
    client.put_object("server-test", "a/b.txt", io.BytesIO(b"hello"), 5)
    response = client.get_object("server-test", "a/b.txt")
    assert response.read() == b"hello"
    response.close()
    response.release_conn()


def test_the_broker_answers_ping(valkey_server: ValkeyServer) -> None:
    with socket.create_connection((valkey_server.host, valkey_server.port), timeout=2) as connection:
        connection.sendall(b"PING\r\n")
        assert connection.recv(16) == b"+PONG\r\n"
