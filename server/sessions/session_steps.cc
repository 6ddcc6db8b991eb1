#include "server/sessions/session_steps.h"

#include <map>

namespace wellspace::server {

void SessionSteps::NoteRefinement(uint64_t points, const core::MeshParameters& parameters, SizesInUse sizes) {
  steps_.push_back({.uploads_end = points,
                    .end = points,
                    .refined_with = std::make_shared<const core::MeshParameters>(parameters),
                    .sizes = sizes});
}

void SessionSteps::NoteAddition(uint64_t uploads_end, uint64_t end) {
  steps_.push_back({.uploads_end = uploads_end, .end = end, .refined_with = nullptr, .sizes = {}});
}

void SessionSteps::ResolveSizes(const std::function<std::shared_ptr<const core::SizeSamples>(uint64_t number)>& find) {
  for (SessionStep& step : steps_) {
    if (step.sizes.number != 0) {
      core::MeshParameters parameters = *step.refined_with;
      parameters.size_samples = find(step.sizes.number);
      step.refined_with = std::make_shared<const core::MeshParameters>(std::move(parameters));
    }
  }
}

std::vector<SizesInUse> SessionSteps::sizes() const {
  std::map<uint64_t, uint64_t> counts;
  for (const SessionStep& step : steps_) {
    if (step.sizes.number != 0) {
      counts[step.sizes.number] = step.sizes.count;
    }
  }
  std::vector<SizesInUse> sizes;
  for (const auto& [number, count] : counts) {
    sizes.push_back({.number = number, .count = count});
  }
  return sizes;
}

}  // namespace wellspace::server
