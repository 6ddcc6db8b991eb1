"""The files of deploy/ that have to agree with each other."""
import json
import os
import pathlib
import re
import socket
import subprocess
import unittest
import urllib.parse
import urllib.request

try:
    import yaml
except ImportError:
    yaml = None

import wellspaced

DEPLOY = pathlib.Path(__file__).resolve().parents[2] / "deploy"


@unittest.skipIf(yaml is None, "python3-yaml is not installed")
class ReplicasTest(unittest.TestCase):
    def setUp(self):
        self.services = yaml.safe_load((DEPLOY / "compose.replicas.yaml").read_text())["services"]
        self.proxy = (DEPLOY / "haproxy-replicas.cfg").read_text()
        self.servers = sorted(name for name in self.services if name.startswith("mesh-"))

    def test_servers_have_the_names_and_ports_that_the_proxy_and_prometheus_know(self):
        self.assertEqual(self.servers, ["mesh-1", "mesh-2", "mesh-3"])
        known = re.findall(r"^  server (\S+) (\S+)$", self.proxy, re.MULTILINE)
        advertised = [self.services[name]["environment"]["WELLSPACED_ADVERTISE"] for name in self.servers]
        self.assertEqual(known, [(address, address) for address in advertised])
        self.assertEqual([self.services[name]["hostname"] for name in self.servers], self.servers)
        for name, address in zip(self.servers, advertised):
            options = dict(option.removeprefix("--").split("=", 1) for option in self.services[name]["command"]
                           if "=" in option)
            self.assertEqual(address, f"{name}:{options['listen'].rsplit(':', 1)[1]}")
            port = options["metrics-listen"].rsplit(":", 1)[1]
            self.assertIn(f"http-check connect port {port} ", self.proxy)
        scraped = yaml.safe_load((DEPLOY / "prometheus" / "replicas.yml").read_text())["scrape_configs"]
        self.assertEqual(scraped[0]["static_configs"][0]["targets"], [f"{name}:{port}" for name in self.servers])

    def test_what_is_mounted_is_there(self):
        for service in self.services.values():
            for volume in service.get("volumes", []):
                if volume.startswith("./"):
                    self.assertTrue((DEPLOY / volume.split(":")[0]).exists(), volume)
        self.assertIn(self.services["prometheus"]["command"][0].rsplit("/", 1)[1],
                      [path.name for path in (DEPLOY / "prometheus").iterdir()])

    def test_the_proxy_serves_without_tls_as_compose_writes_it(self):
        script = self.services["proxy"]["command"][2]
        for pattern, _ in re.findall(r"-e 's#([^#]*)#([^#]*)#", script):
            self.assertRegex(self.proxy, pattern)


@unittest.skipIf(yaml is None, "python3-yaml is not installed")
class ConsoleTest(unittest.TestCase):
    def setUp(self):
        self.files = {name: yaml.safe_load((DEPLOY / name).read_text())["services"]
                      for name in ("compose.yaml", "compose.replicas.yaml")}
        self.console = self.files["compose.yaml"]["console"]

    def test_is_on_the_loopback_of_the_host_where_the_server_is_published(self):
        replicas = self.files["compose.replicas.yaml"]
        self.assertEqual(replicas["console"]["extends"], {"file": "compose.yaml", "service": "console"})
        self.assertEqual(self.console["network_mode"], "host")
        self.assertNotIn("ports", self.console)
        server = self.console["environment"]["WELLSPACE_SERVER"]
        port = server.rsplit(":", 1)[1]
        for publisher in (self.files["compose.yaml"]["wellspace"], replicas["proxy"]):
            self.assertIn(f"{server}:{port}", publisher["ports"])
        for services in self.files.values():
            self.assertNotIn("127.0.0.1:8080:", str(services))  # nothing else takes its port

    def test_command_serves_the_page_on_the_loopback_alone(self):
        server = wellspaced.Wellspaced("--ephemeral")
        self.addCleanup(server.stop)
        program, *arguments = self.console["entrypoint"]
        self.assertEqual(arguments.pop(), "--port=8080")
        environment = {**os.environ, **self.console["environment"],
                       **self.files["compose.replicas.yaml"]["console"]["environment"],
                       "WELLSPACE_SERVER": server.address}
        console = subprocess.Popen([wellspaced.BIN / program, *arguments], env=environment, stdout=subprocess.PIPE,
                                   text=True)
        self.addCleanup(console.communicate)
        self.addCleanup(console.terminate)
        url = console.stdout.readline().strip()
        self.assertRegex(url, r"^http://127\.0\.0\.1:\d+/[0-9a-f]{32}/$")
        with urllib.request.urlopen(url + "api/server", timeout=60) as answer:
            self.assertEqual(json.load(answer)["health"], "serving")
        port = urllib.parse.urlsplit(url).port
        with self.assertRaises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.2", port), timeout=60)


if __name__ == "__main__":
    unittest.main()
