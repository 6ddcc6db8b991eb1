#include "server/sessions/session_use.h"

#include <utility>

namespace wellspace::server {

SessionUse::SessionUse(std::shared_ptr<Session> session) : session_(std::move(session)) {
  absl::MutexLock lock(&session_->mutex_);
  session_->occupancy_.lease.BeginUse();
}

SessionUse::~SessionUse() {
  {
    absl::MutexLock lock(&session_->mutex_);
    session_->occupancy_.lease.EndUse(session_->clock_.since_boot());
  }
  session_->NoteIdle();  // its earlier mesh may have been in use
}

std::unique_ptr<UploadUse> UploadUse::Begin(std::shared_ptr<Session> session) {
  absl::MutexLock lock(&session->mutex_);
  return std::exchange(session->occupancy_.is_uploading, true) ? nullptr
                                                               : std::unique_ptr<UploadUse>(new UploadUse(session));
}

UploadUse::~UploadUse() {
  absl::MutexLock lock(&session_->mutex_);
  session_->occupancy_.is_uploading = false;
}

StructureUse::StructureUse(std::shared_ptr<Session> session) : session_(std::move(session)) {
  absl::MutexLock lock(&session_->mutex_);
  ++session_->occupancy_.structure_uses;
}

StructureUse::~StructureUse() {
  {
    absl::MutexLock lock(&session_->mutex_);
    --session_->occupancy_.structure_uses;
  }
  session_->NoteIdle();
}

}  // namespace wellspace::server
