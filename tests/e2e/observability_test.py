"""wellspaced as operators see it: /metrics over HTTP, logs as JSON, dashboard and alerts of metrics that there are."""
import http.client
import json
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

import grpc
from wellspaced import BIN, PATIENCE, ROOT, Wellspaced, api

CLOUD = ROOT / "examples" / "spot.csv"
POINTS = 2930  # of the cloud

# Made by Prometheus itself.
OF_PROMETHEUS = {"up"}
# Words of PromQL and of Grafana that look like metrics, and labels.
WORDS = set("sum by rate changes histogram_quantile label_values job instance le grpc_type grpc_service grpc_method "
            "grpc_code".split())


class Daemon(Wellspaced):
    """With metrics, and a log of JSON in a file."""

    def __init__(self, folder, *arguments, environment=None):
        self.log = folder / "log"
        with open(self.log, "wb") as log:
            super().__init__("--metrics-listen", "127.0.0.1:0", "--log-format", "json", "--workers", "2", *arguments,
                             log=log, environment=environment)
        self.metrics_address = self.read_address("metrics on ")

    def get(self, path):
        connection = http.client.HTTPConnection(self.metrics_address, timeout=600)
        try:
            connection.request("GET", path)
            response = connection.getresponse()
            return response.status, response.getheader("Content-Type"), response.read().decode()
        finally:
            connection.close()

    def metrics(self):
        """{'name{label="value",…}': value} of all series."""
        _, _, text = self.get("/metrics")
        lines = [line for line in text.splitlines() if line and not line.startswith("#")]
        return {series: float(value) for series, value in (line.rsplit(" ", 1) for line in lines)}

    def log_lines(self):
        """All lines that the log ends up with; the daemon has to be stopped."""
        return [json.loads(line) for line in self.log.read_text().splitlines()]


class Observability(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def start(self, *arguments, **options):
        daemon = Daemon(self.folder, *arguments, **options)
        self.addCleanup(daemon.kill)
        return daemon

    def mesh(self, daemon):
        done = subprocess.run([BIN / "wellspace", "mesh", CLOUD, "-o", self.folder / "mesh.vtu", "--quiet", "--stats",
                               "-", "--server",
                               daemon.address], capture_output=True, text=True, timeout=600, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_metrics_count_what_a_client_did(self):
        daemon = self.start()
        statistics = self.mesh(daemon)
        status, content_type, text = daemon.get("/metrics")
        self.assertEqual(status, 200)
        self.assertTrue(content_type.startswith("text/plain"), content_type)
        self.assertIn("# TYPE grpc_server_handled_total counter", text)
        self.assertIn("# TYPE grpc_server_handling_seconds histogram", text)
        metrics = daemon.metrics()
        self.assertEqual(metrics["wellspace_vertices_made_total"], statistics["vertices"])
        self.assertEqual(metrics["wellspace_simplices_made_total"], statistics["simplices"])
        self.assertEqual(metrics["wellspace_points_received_total"], POINTS)
        self.assertEqual(metrics["wellspace_workers"], 2)
        labels = 'grpc_method="MeshPoints",grpc_service="wellspace.v1.MeshingService",grpc_type="bidi_stream"'
        self.assertEqual(metrics[f'grpc_server_handled_total{{grpc_code="OK",{labels}}}'], 1)
        self.assertGreaterEqual(metrics[f"grpc_server_msg_sent_total{{{labels}}}"], 2)
        self.assertEqual(daemon.get("/")[0], 404)
        self.assertEqual(daemon.stop(), 0)

    def test_a_client_that_does_not_ask_holds_nobody_up(self):
        daemon = self.start()
        host, port = daemon.metrics_address.rsplit(":", 1)
        with socket.create_connection((host, int(port))) as silent:
            silent.sendall(b"GET /metr")
            self.assertEqual(daemon.get("/metrics")[0], 200)
            self.assertEqual(daemon.stop(), 0)

    def hold(self, daemon):
        """A call that does not end before the test, for which the daemon waits when it stops."""
        channel = grpc.insecure_channel(daemon.address)
        self.addCleanup(channel.close)
        end = threading.Event()
        self.addCleanup(end.set)

        def requests():
            yield api().MeshPointsRequest(parameters=api().MeshParameters(dimension=2))
            end.wait()

        call = api().MeshingServiceStub(channel).MeshPoints(requests())
        while daemon.metrics()["wellspace_calls_in_flight"] == 0:
            time.sleep(0.01)
        return call

    def test_probes_tell_of_sigterm_within_a_tenth_of_a_second(self):
        seconds = []
        for _ in range(3):  # the quickest: the others may have waited for a processor
            daemon = self.start("--grace", "600")
            self.hold(daemon)
            self.assertEqual(daemon.get("/readyz"), (200, "text/plain", "ready\n"))
            begin = time.monotonic()
            daemon.process.send_signal(signal.SIGTERM)
            while (answer := daemon.get("/readyz"))[0] == 200:
                pass
            seconds.append(time.monotonic() - begin)
            self.assertEqual(answer, (503, "text/plain", "stopping\n"))
            self.assertEqual(daemon.get("/livez")[0], 200)
            self.assertEqual(daemon.get("/healthz")[0], 404)
            daemon.kill()
        self.assertLess(min(seconds), 0.1)

    def test_the_health_check_of_the_container_asks_whether_it_is_ready(self):
        line = re.search(r'test: (\["CMD", "bash", .*\])$', (ROOT / "deploy" / "compose.yaml").read_text(),
                         re.MULTILINE)
        _, *command = json.loads(line[1].replace("$$", "$"))
        daemon = self.start("--grace", "600")
        command[-1] = command[-1].replace("127.0.0.1/9464", daemon.metrics_address.replace(":", "/"))

        def check():
            done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
            return done.returncode, done.stdout.splitlines()[-1:]

        self.assertEqual(check(), (0, ["ready"]))
        self.hold(daemon)
        daemon.process.send_signal(signal.SIGTERM)
        while daemon.get("/readyz")[0] == 200:
            pass
        self.assertEqual(check(), (1, ["stopping"]))
        daemon.kill()
        self.assertEqual(check(), (1, []))

    def test_the_service_manager_is_told(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
            manager.bind(str(self.folder / "notify"))
            manager.settimeout(PATIENCE)
            daemon = self.start(environment={"NOTIFY_SOCKET": str(self.folder / "notify")})
            self.assertEqual(manager.recv(100), b"READY=1")
            self.assertEqual(daemon.stop(), 0)
            self.assertEqual(manager.recv(100), b"STOPPING=1")
        self.assertIn("\nType=notify\n", (ROOT / "deploy" / "wellspaced.service").read_text())

    def test_log_is_json_and_has_a_line_for_the_call(self):
        daemon = self.start()
        statistics = self.mesh(daemon)
        self.assertEqual(daemon.stop(), 0)
        lines = daemon.log_lines()
        for line in lines:
            self.assertRegex(line["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
            self.assertIn(line["level"], ["debug", "info", "warning", "error"])
        calls = [line for line in lines if line.get("event") == "call" and line["method"] == "MeshPoints"]
        self.assertEqual(len(calls), 1)
        call = calls[0]
        self.assertEqual(call["code"], "OK")
        self.assertEqual(call["tenant"], "default")
        self.assertEqual(call["service"], "wellspace.v1.MeshingService")
        self.assertEqual(call["points"], POINTS)
        self.assertEqual(call["vertices"], statistics["vertices"])
        self.assertGreater(call["seconds"], 0)
        self.assertTrue(call["peer"].startswith("ipv4:127.0.0.1:"))
        self.assertTrue(call["request_id"])
        self.assertEqual([line["event"] for line in lines[-2:]], ["stopping", "stopped"])

    def test_dashboard_and_alerts_ask_for_metrics_that_there_are(self):
        daemon = self.start()
        known = {re.sub(r"\{.*", "", series) for series in daemon.metrics()} | OF_PROMETHEUS
        self.assertEqual(daemon.stop(), 0)
        dashboard = json.loads((ROOT / "deploy" / "grafana" / "wellspace.json").read_text())
        asked = {f"panel {panel['title']}": target["expr"]
                 for panel in dashboard["panels"] for target in panel.get("targets", [])}
        asked |= {f"variable {variable['name']}": variable["query"]["query"]
                  for variable in dashboard["templating"]["list"] if variable["type"] == "query"}
        alerts = (ROOT / "deploy" / "prometheus" / "alerts.yml").read_text()
        rules = re.findall(r"- alert: (\w+)\n +expr:(.*?)\n +(?:for|labels):", alerts, re.DOTALL)
        self.assertEqual(len(rules), alerts.count("- alert:"))
        asked |= {f"alert {name}": expr.replace(">-", "") for name, expr in rules}
        self.assertGreater(len(asked), 20)
        for who, expr in asked.items():
            bare = re.sub(r'"[^"]*"|\{[^}]*\}|\[[^\]]*\]', " ", expr)  # without label values, matchers and ranges
            names = set(re.findall(r"[a-zA-Z_]\w*", bare)) - WORDS
            self.assertTrue(names, who)
            self.assertLessEqual(names, known, who)

    @unittest.skipUnless(shutil.which("promtool"), "promtool is not installed")
    def test_promtool_accepts_the_rules_and_what_they_do(self):
        prometheus = ROOT / "deploy" / "prometheus"
        for arguments in (["check", "config", prometheus / "prometheus.yml"],
                          ["test", "rules", pathlib.Path(__file__).parent / "alerts_test.yml"]):
            done = subprocess.run(["promtool", *arguments], capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    @unittest.skipUnless(shutil.which("systemd-analyze"), "systemd is not installed")
    def test_the_unit_is_valid_and_hardened(self):
        unit = self.folder / "wellspaced.service"
        # The unit names the program where an administrator would install it.
        unit.write_text((ROOT / "deploy" / "wellspaced.service").read_text().replace(
            "/usr/local/bin/wellspaced", str(BIN / "wellspaced")))
        for arguments in (["verify", "--man=no", unit],
                          ["security", "--offline=true", "--threshold=20", "--no-pager", unit]):
            done = subprocess.run(["systemd-analyze", *arguments], capture_output=True, text=True, timeout=60,
                                  check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
