#include "server/sessions/session_steps.h"

namespace wellspace::server {

void SessionSteps::NoteRefinement(uint64_t points, const core::MeshParameters& parameters) {
  steps_.push_back(
      {.uploads_end = points, .end = points, .refined_with = std::make_shared<const core::MeshParameters>(parameters)});
}

void SessionSteps::NoteAddition(uint64_t uploads_end, uint64_t end) {
  steps_.push_back({.uploads_end = uploads_end, .end = end, .refined_with = nullptr});
}

}  // namespace wellspace::server
