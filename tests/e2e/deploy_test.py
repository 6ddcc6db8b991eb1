"""The files of deploy/ that have to agree with each other."""
import pathlib
import re
import unittest

try:
    import yaml
except ImportError:
    yaml = None

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


if __name__ == "__main__":
    unittest.main()
