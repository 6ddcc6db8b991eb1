#include "server/sessions/session_use.h"

#include <mutex>
#include <utility>

namespace wellspace::server {

SessionUse::SessionUse(std::shared_ptr<Session> session) : session_(std::move(session)) {
  std::lock_guard lock(session_->mutex_);
  session_->lease_.BeginUse();
}

SessionUse::~SessionUse() {
  std::lock_guard lock(session_->mutex_);
  session_->lease_.EndUse(session_->clock_.since_boot());
}

StructureUse::StructureUse(std::shared_ptr<Session> session) : session_(std::move(session)) {
  std::lock_guard lock(session_->mutex_);
  ++session_->structure_uses_;
}

StructureUse::~StructureUse() {
  {
    std::lock_guard lock(session_->mutex_);
    --session_->structure_uses_;
  }
  session_->NoteIdle();
}

}  // namespace wellspace::server
