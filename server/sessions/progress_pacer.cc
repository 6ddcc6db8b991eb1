#include "server/sessions/progress_pacer.h"

#include <algorithm>
#include <utility>

#include "server/wire/convert.h"

namespace wellspace::server {

std::optional<v1::ProgressEvent> ProgressPacer::Next(const core::Progress& progress, absl::Duration now) {
  const absl::Duration age = now - last_time_;
  if (age < kMinInterval) {
    return std::nullopt;
  }
  v1::ProgressEvent event = Advance(progress);
  const bool changed = event.phase() != last_.phase() || event.vertices() != last_.vertices() ||
                       event.simplices() != last_.simplices() || event.fraction() != last_.fraction() ||
                       event.estimated_vertices() != last_.estimated_vertices();
  if (!changed && age < kHeartbeat) {
    return std::nullopt;
  }
  event.set_sequence(next_sequence_++);
  last_time_ = now;
  last_ = event;
  return event;
}

v1::ProgressEvent ProgressPacer::Final(const core::Progress& progress) {
  v1::ProgressEvent event = Advance(progress);
  event.set_phase(v1::PHASE_DONE);
  event.set_fraction(1);
  return Final(std::move(event));
}

v1::ProgressEvent ProgressPacer::Final(v1::ProgressEvent event) {
  event.set_vertices(std::max(event.vertices(), last_.vertices()));
  event.set_simplices(std::max(event.simplices(), last_.simplices()));
  event.set_sequence(next_sequence_++);
  last_ = event;
  return event;
}

v1::ProgressEvent ProgressPacer::Advance(const core::Progress& progress) {
  phase_ = std::max(phase_, progress.phase);
  v1::ProgressEvent event;
  event.set_phase(PhaseToProto(phase_));
  event.set_vertices(std::max<uint64_t>(progress.vertices, last_.vertices()));
  event.set_estimated_vertices(progress.estimated_vertices);
  event.set_simplices(std::max<uint64_t>(progress.simplices, last_.simplices()));
  event.set_fraction(std::clamp(progress.fraction, last_.fraction(), 1.0));
  return event;
}

}  // namespace wellspace::server
