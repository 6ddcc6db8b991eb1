// A core::Mesher as a test wants it: with a script for each phase, or with a given mesh.
#ifndef WELLSPACE_TESTS_SERVER_SCRIPTED_MESHER_H_
#define WELLSPACE_TESTS_SERVER_SCRIPTED_MESHER_H_

#include <cstdint>
#include <functional>

#include "core/meshers/mesher.h"
#include "server/calls/call_environment.h"

namespace wellspace::server {

// The action of a ScriptedMesher in a phase; its status ends the run.
using PhaseScript = std::function<absl::Status(core::Phase, core::RunContext&)>;

// Meshers that enter the phases of the core, run `script` in each, and have a mesh of MakeFakeMesh.
MesherFactory ScriptedMesher(PhaseScript script);

// Meshers of which every mesh is `mesh`.
MesherFactory FixedMesher(core::Mesh mesh);

// Works in `phase` until its context is cancelled, and calls `begun` before.
PhaseScript EndlessIn(core::Phase phase, std::function<void()> begun);

// A mesh of `simplex_count` simplices in 3-D, which no geometry would allow: the arrays are as long as they would be,
// and have something else in every row.
core::Mesh MakeLargeMesh(uint64_t simplex_count);

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_SCRIPTED_MESHER_H_
