#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Bakes by way of a store behind nginx with its dav module: the bytes of a bake without one, whatever the server does.

    nginx_test.py --relume FILE --source DIR

Exit status: 0 it holds; 1 it does not; 77 there is no nginx with the dav module.
"""
import argparse
import ctypes
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

PR_SET_PDEATHSIG = 1
LIBC = ctypes.CDLL(None, use_errno=True)

CONFIG = """
daemon off;
master_process off;
pid {folder}/nginx.pid;
error_log {folder}/error.log;
events {{}}
http {{
  access_log off;
  client_body_temp_path {folder}/body;
  proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/fastcgi;
  uwsgi_temp_path {folder}/uwsgi;
  scgi_temp_path {folder}/scgi;
  server {{
    listen 127.0.0.1:{port};
    root {folder}/files;
    client_max_body_size 1g;
    location /store/ {{ dav_methods PUT; create_full_put_path on; }}
    location /read/ {{ alias {folder}/files/store/; }}
    location /small/ {{ dav_methods PUT; create_full_put_path on; client_max_body_size 1k; }}
    location /full/ {{ if ($request_method = PUT) {{ return 507; }} }}
    location /closed/ {{ return 403; }}
    location /lying/ {{ return 200 "this is no entry"; }}
  }}
}}
"""


class Failed(Exception):
    pass


def expect(holds, what):
    if not holds:
        raise Failed(what)


def end_with_parent():
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def free_port():
    with socket.socket() as each:
        each.bind(("127.0.0.1", 0))
        return each.getsockname()[1]


class Server:
    """nginx in a folder of its own."""

    def __init__(self, nginx, folder):
        self.nginx, self.folder, self.port, self.process = nginx, folder, free_port(), None
        # It may give up root's rights, and must reach its files then.
        folder.chmod(0o755)
        (folder / "files" / "store").mkdir(parents=True)
        user = "user root;\n" if os.geteuid() == 0 else ""
        (folder / "nginx.conf").write_text(user + CONFIG.format(folder=folder, port=self.port))

    def start(self):
        self.process = subprocess.Popen([self.nginx, "-c", f"{self.folder}/nginx.conf", "-p", str(self.folder), "-e", "stderr"],
                                        stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, preexec_fn=end_with_parent)
        end = time.monotonic() + 300
        while time.monotonic() < end:
            expect(self.process.poll() is None, "nginx does not start: " + str(self.process.poll()))
            with socket.socket() as each:
                if each.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.02)
        raise Failed("nginx does not listen")

    def stop(self):
        if self.process and self.process.poll() is None:
            self.process.kill()
        if self.process:
            self.process.wait()
            self.process.stderr.close()

    def url(self, location):
        return f"http://127.0.0.1:{self.port}/{location}"


class Silent:
    """A server that takes connections and never answers."""

    def __enter__(self):
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.socket.settimeout(300)
        self.connections = []
        self.url = f"http://127.0.0.1:{self.socket.getsockname()[1]}/"
        return self

    def await_connection(self):
        self.connections.append(self.socket.accept()[0])

    def __exit__(self, *_):
        for each in [self.socket, *self.connections]:
            each.close()


class Test:
    def __init__(self, relume, level, folder, server):
        self.relume, self.level, self.folder, self.server, self.count = relume, level, folder, server, 0
        self.plain = self.bake(None)[0]

    def bake(self, store, *more):
        """The bytes of a bake, and what was printed."""
        self.count += 1
        output = self.folder / f"{self.count}.relume"
        command = [self.relume, "bake", self.level, "-o", output, "--preset", "draft", "--progress", "none", *more]
        if store:
            command += ["--store", store, "--store-stats"]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=900)
        expect(ended.returncode == 0, f"{store}: status {ended.returncode}: {ended.stderr}")
        return output.read_bytes(), ended.stdout + ended.stderr

    def same(self, store, *words):
        data, said = self.bake(store)
        expect(data == self.plain, f"{store}: other bytes than without a store")
        for word in words:
            expect(word in said, f"{store}: \"{word}\" expected in: {said}")
        return said

    def run(self):
        store = self.server.url("store")
        self.same(store, " 0 entries found")
        said = self.same(store, " 0 missing, 0 damaged, 0 written")
        expect("store http://127.0.0.1" in said, said)
        self.same(self.server.url("read/"), " 0 missing")

        # Damaged on the server: found by its checksum, and mended.
        files = sorted(path for path in (self.server.folder / "files" / "store").rglob("*") if path.is_file())
        expect(len(files) == 6, "play space, caches, a plan, a threshold and two blocks of links on the server")
        for file in files:
            data = bytearray(file.read_bytes())
            data[len(data) // 2] ^= 1
            file.write_bytes(data)
        self.same(store, " 6 damaged, 6 written", "is made again: damaged")
        self.same(store, " 0 missing, 0 damaged")
        for file in files:
            file.write_bytes(b"")
        self.same(self.server.url("read"), "nothing more is kept in it: PUT")

        # Servers that refuse.
        self.same(self.server.url("small"), "the server answers 413")
        self.same(self.server.url("full"), "it is full")
        self.same(self.server.url("closed"), "GET: the server answers 403")
        self.same(self.server.url("lying"), "is made again: cut to 16 bytes")
        self.same(f"http://127.0.0.1:{free_port()}/", "done without")

        # Entries that are far longer than their headers say, and what is no entry.
        self.same(store, " 6 written")
        for file in files:
            os.truncate(file, 1 << 32)
        self.same(store, " 6 damaged, 6 written", "it has 4294967296 bytes, by its header at most ")
        for file in files:
            file.write_bytes(bytes(100))
        self.same(store, " 6 damaged, 6 written", "not an entry of a store")

        # Two bakes at once into an empty store.
        shutil.rmtree(self.server.folder / "files" / "store")
        failures = []

        def one():
            try:
                self.same(store)
            except Failed as failed:
                failures.append(str(failed))

        bakes = [threading.Thread(target=one) for _ in range(3)]
        for each in bakes:
            each.start()
        for each in bakes:
            each.join()
        expect(not failures, "; ".join(failures))
        self.same(store, " 0 missing, 0 damaged")

        # The server's folder is held to a size where it lies.
        kept = subprocess.run([self.relume, "store", "gc", self.server.folder / "files" / "store", "--limit", "4K"],
                              capture_output=True, text=True, timeout=300)
        expect(kept.returncode == 0 and " removed (" in kept.stdout, kept.stdout + kept.stderr)
        self.same(store, " written (")
        refused = subprocess.run([self.relume, "store", "gc", store], capture_output=True, text=True, timeout=300)
        expect(refused.returncode == 1 and "run it on the server" in refused.stderr, refused.stderr)

        # A server that falls silent does not hold up Ctrl-C.
        with Silent() as silent:
            command = [self.relume, "bake", self.level, "-o", self.folder / "never.relume", "--store", silent.url]
            waiting = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                       preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
            silent.await_connection()
            expect(waiting.poll() is None, "it waits for the server")
            waiting.send_signal(signal.SIGINT)
            expect(waiting.wait(timeout=300) == 130, "cancelled")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--relume", required=True)
    parser.add_argument("--source", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    nginx = shutil.which("nginx", path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")
    if not nginx or b"http_dav_module" not in subprocess.run([nginx, "-V"], capture_output=True).stderr:
        print("skipped: no nginx with the dav module (Debian: nginx-light)")
        return 77
    with tempfile.TemporaryDirectory(prefix="relume_nginx_") as temporary:
        folder = pathlib.Path(temporary)
        server = Server(nginx, folder)
        try:
            server.start()
            Test(arguments.relume, arguments.source / "samples" / "level" / "two_rooms.glb", folder, server).run()
        except Failed as failed:
            log = folder / "error.log"
            print(f"failed: {failed}\n{log.read_text()[-2000:] if log.exists() else ''}")
            return 1
        finally:
            server.stop()
    print("bakes by way of nginx are the same bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
