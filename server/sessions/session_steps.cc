#include "server/sessions/session_steps.h"

#include <map>
#include <utility>

namespace wellspace::server {

void SessionSteps::Add(SessionStep step) {
  rest_.push_back(std::move(step));
  if (rest_.size() == kBlock) {
    blocks_.push_back(std::make_shared<const Block>(std::exchange(rest_, {})));
  }
}

void SessionSteps::NoteRefinement(uint64_t points, std::shared_ptr<const core::MeshParameters> parameters,
                                  SizesInUse sizes) {
  Add({.uploads_end = points, .end = points, .refined_with = std::move(parameters), .sizes = sizes});
}

void SessionSteps::NoteAddition(uint64_t uploads_end, uint64_t end) {
  Add({.uploads_end = uploads_end, .end = end, .refined_with = nullptr, .sizes = {}});
}

std::vector<SizesInUse> SessionSteps::sizes() const {
  std::map<uint64_t, uint64_t> counts;
  const auto look = [&](const Block& block) {
    for (const SessionStep& step : block) {
      if (step.sizes.number != 0) {
        counts[step.sizes.number] = step.sizes.count;
      }
    }
  };
  for (const std::shared_ptr<const Block>& block : blocks_) {
    look(*block);
  }
  look(rest_);
  std::vector<SizesInUse> sizes;
  for (const auto& [number, count] : counts) {
    sizes.push_back({.number = number, .count = count});
  }
  return sizes;
}

std::vector<SessionStep> SessionSteps::all() const {
  std::vector<SessionStep> steps;
  steps.reserve(count());
  for (const std::shared_ptr<const Block>& block : blocks_) {
    steps.insert(steps.end(), block->begin(), block->end());
  }
  steps.insert(steps.end(), rest_.begin(), rest_.end());
  return steps;
}

uint64_t SessionSteps::points() const {
  return !rest_.empty() ? rest_.back().end : blocks_.empty() ? 0 : blocks_.back()->back().end;
}

}  // namespace wellspace::server
