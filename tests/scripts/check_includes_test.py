"""scripts/check_includes finds planted violations, and nothing in allowed ones."""

import pathlib
import subprocess
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_includes"

# A small project in order; each test plants one line in it.
SOUND = {
    "core/base/ids.h": "#include <cstdint>\n",
    "core/base/status_macros.h": '#include "absl/status/status.h"\n',
    "core/geometry/point.h": '#include "core/base/ids.h"\n',
    "core/validate/validate.h": '#include "absl/status/status.h"\n#include "core/geometry/point.h"\n',
    "core/simplex/star.h": '#include "core/geometry/point.h"\n',
    "core/cell/polytope.h": '#include "core/geometry/point.h"\n',
    "core/voronoi/star.h": '#include "core/cell/polytope.h"\n',
    "core/refine/rules.h": '#include "core/voronoi/star.h"\n',
    "core/refine/plane/planar.h": '#include "core/refine/rules.h"\n',
    "core/refine/speculation/rounds.h": '#include "core/refine/plane/planar.h"\n',
    "core/refine/refine.h": '#include "core/refine/plane/planar.h"\n#include "core/refine/speculation/rounds.h"\n',
    "server/sessions/session.h": '#include "server/base/options.h"\n',
    "server/base/options.h": "#include <memory>\n",
    "core/meshers/mesher.h": '#include "core/simplex/star.h"\n',
    "server/embedded_server.h": "#include <memory>\n",
    "server/wire/convert.cc": '#include "core/meshers/mesher.h"\n#include "wellspace/v1/mesh.pb.h"\n'
                              '#include <grpcpp/grpcpp.h>\n',
    "client/client.h": '#include "absl/time/time.h"\n',
    "client/connection.cc": '#include "client/client.h"\n#include "google/rpc/status.pb.h"\n',
    "client/grpc/calls.cc": '#include "client/client.h"\n#include "wellspace/v1/meshing.grpc.pb.h"\n'
                            '#include <grpcpp/grpcpp.h>\n',
    "client/grpc/calls.h": "#include <memory>\n",
    "client/formats/vtu.cc": '#include "client/formats/vtu.h"\n#include "core/base/status_macros.h"\n'
                             '#include <zlib.h>\n',
    "client/cli/main.cc": '#include "client/formats/vtu.h"\n#include "server/embedded_server.h"\n'
                          '#include "core/validate/validate.h"\n',
    "client/formats/vtu.h": "#include <string>\n",
    "client/python/src/package/__init__.py": "from . import errors\nfrom ._mesh import Mesh\n",
    "client/python/src/package/_mesh.py": "from ._dual import cells\nfrom .errors import Error\n",
    "client/python/src/package/_dual.py": "import numpy\n",
    "client/python/src/package/errors.py": "import os\n",
    "tests/core/meshers/mesher_test.cc": '#include "core/meshers/mesher.h"\n#include "gtest/gtest.h"\n',
}


class CheckIncludesTest(unittest.TestCase):
    def run_with(self, path=None, line=""):
        """Runs the script on the sound project with `line` as the last of `path`; returns its exit code and lines."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            files = dict(SOUND)
            if path:
                files[path] = files.get(path, "") + line + "\n"
            for name, text in files.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            result = subprocess.run([SCRIPT, root], capture_output=True, text=True, check=False)
            self.assertEqual(result.stderr, "")
            return result.returncode, result.stdout.splitlines()

    def assert_found(self, path, line, message):
        code, lines = self.run_with(path, line)
        number = SOUND.get(path, "").count("\n") + 1
        self.assertEqual(code, 1)
        self.assertEqual(len(lines), 1, lines)
        self.assertTrue(lines[0].startswith(f"{path}:{number}: "), lines[0])
        self.assertIn(message, lines[0])

    def test_accepts_the_order_of_the_house(self):
        self.assertEqual(self.run_with(), (0, []))

    def test_lower_part_of_core_includes_higher_part(self):
        self.assert_found("core/base/ids.h", '#include "core/geometry/point.h"', "core/base may include only core/base")

    def test_part_of_core_includes_the_mesher(self):
        self.assert_found("core/simplex/star.h", '#include "core/meshers/mesher.h"', "core/simplex may include only")

    def test_rooms_below_include_rooms_above(self):
        self.assert_found("core/cell/polytope.h", '#include "core/voronoi/star.h"', "core/cell may include only")
        self.assert_found("server/wire/convert.cc", '#include "server/sessions/session.h"',
                          "server/wire may include only")
        self.assert_found("server/sessions/session.h", '#include "server/embedded_server.h"',
                          "server/sessions may include only")

    def test_parts_of_the_refinement_include_what_is_above_them(self):
        for path, header in (
            ("core/refine/rules.h", "plane/planar.h"),
            ("core/refine/rules.h", "speculation/rounds.h"),
            ("core/refine/plane/planar.h", "speculation/rounds.h"),
        ):
            self.assert_found(path, f'#include "core/refine/{header}"', "may include only")
        for path in ("core/refine/rules.h", "core/refine/plane/planar.h", "core/refine/speculation/rounds.h"):
            self.assert_found(path, '#include "core/refine/refine.h"', "stands above")

    def test_core_includes_server(self):
        self.assert_found("core/meshers/mesher.h", '#include "server/embedded_server.h"',
                          "core/meshers may include only")

    def test_core_sees_grpc_protobuf_logging_or_messages(self):
        for header in ("grpcpp/grpcpp.h", "google/protobuf/message.h", "spdlog/spdlog.h", "wellspace/v1/mesh.pb.h"):
            self.assert_found("core/base/ids.h", f"#include <{header}>", "must not see")

    def test_formats_see_messages(self):
        self.assert_found("client/formats/vtu.cc", '#include "proto/wellspace/v1/mesh.pb.h"', "must not see")

    def test_formats_see_the_client_library(self):
        self.assert_found("client/formats/vtu.cc", '#include "client/client.h"', "client/formats may include only")

    def test_client_library_includes_core(self):
        self.assert_found("client/connection.cc", '#include "core/meshers/mesher.h"',
                          "client may include only client, proto")

    def test_only_the_transport_of_the_client_sees_grpc_and_messages(self):
        for header in ("grpcpp/grpcpp.h", "grpc/grpc.h", "wellspace/v1/meshing.grpc.pb.h"):
            self.assert_found("client/client.h", f"#include <{header}>", "client must not see")

    def test_the_transport_is_seen_by_itself_alone(self):
        for path in ("client/client.h", "client/formats/vtu.cc", "client/cli/main.cc"):
            self.assert_found(path, '#include "client/grpc/calls.h"', "may include only")

    def test_a_new_folder_of_the_client_wants_a_rule(self):
        self.assert_found("client/extra/a.h", "#include <memory>", "no rule for this folder")

    def test_client_library_includes_server(self):
        self.assert_found("client/connection.cc", '#  include "server/embedded_server.h"', "client may include only")

    def test_cli_includes_more_of_core_than_the_validators(self):
        self.assert_found("client/cli/main.cc", '#include "core/meshers/mesher.h"', "client/cli may include only")

    def test_server_includes_client(self):
        self.assert_found("server/wire/convert.cc", '#include "client/client.h"', "server/wire may include only")

    def test_product_includes_tests(self):
        self.assert_found("server/wire/convert.cc", '#include "tests/core/meshers/mesher_test.cc"',
                          "server/wire may include only")

    def test_own_header_in_angle_brackets(self):
        self.assert_found("server/wire/convert.cc", "#include <core/meshers/mesher.h>", "with quotes")

    def test_relative_include(self):
        self.assert_found("core/meshers/mesher.h", '#include "../server/embedded_server.h"', "from the root")
        self.assert_found("core/validate/validate.h", '#include "faults.h"', "from the root")

    def test_modules_import_each_other(self):
        for line in ("from ._mesh import Mesh", "if numpy:\n    from . import _mesh",
                     "def f():\n    import package._mesh"):
            code, lines = self.run_with("client/python/src/package/_dual.py", line)
            self.assertEqual((code, len(lines)), (1, 1), lines)
            self.assertRegex(lines[0], r"_dual.py:[23]: a circle of imports: .*_mesh.py -> .*_dual.py -> .*_mesh.py$")
        self.assert_found("client/python/src/package/errors.py", "import package", "circle of imports")

    def test_test_of_no_folder(self):
        self.assert_found("tests/core/magic/spell_test.cc", "", "there is no folder core/magic")

    def test_test_beside_the_folder_of_its_header(self):
        self.assert_found("tests/core/voronoi/polytope_test.cc", "", "is in core/cell: it belongs there")
        self.assertEqual(self.run_with("tests/core/cell/polytope_test.cc"), (0, []))
        self.assertEqual(self.run_with("tests/core/voronoi/star_test.cc"), (0, []), "one of two headers of the name")
        self.assertEqual(self.run_with("tests/e2e/polytope_test.cc"), (0, []), "a folder that mirrors nothing")

    def test_header_that_does_not_exist(self):
        self.assert_found("core/meshers/mesher.h", '#include "core/simplex/stars.h"', "no such file")

    def test_folder_without_a_rule(self):
        self.assert_found("core/magic/spell.h", "", "no rule for this folder")
        self.assert_found("gui/window.cc", "", "no rule for this folder")


if __name__ == "__main__":
    unittest.main()
