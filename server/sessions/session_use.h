// Guards that keep a session, its uploads or its structure, for as long as it is used.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_USE_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_USE_H_

#include <memory>
#include <utility>

#include "server/sessions/session.h"

namespace wellspace::server {

// Keeps a session from expiring, and renews its lease at the end.
class SessionUse {
 public:
  explicit SessionUse(std::shared_ptr<Session> session);
  ~SessionUse();
  SessionUse(const SessionUse&) = delete;
  SessionUse& operator=(const SessionUse&) = delete;

  Session& session() const { return *session_; }
  const std::shared_ptr<Session>& session_ptr() const { return session_; }

 private:
  const std::shared_ptr<Session> session_;
};

// Keeps other uploads from a session.
class UploadUse {
 public:
  // Null: another upload has it.
  static std::unique_ptr<UploadUse> Begin(std::shared_ptr<Session> session);
  ~UploadUse();
  UploadUse(const UploadUse&) = delete;
  UploadUse& operator=(const UploadUse&) = delete;

 private:
  explicit UploadUse(std::shared_ptr<Session> session) : session_(std::move(session)) {}

  const std::shared_ptr<Session> session_;
};

// Keeps a session from giving up its structure for other work: the one of PrepareStructure stays until it was
// asked.
class StructureUse {
 public:
  explicit StructureUse(std::shared_ptr<Session> session);
  ~StructureUse();
  StructureUse(const StructureUse&) = delete;
  StructureUse& operator=(const StructureUse&) = delete;

 private:
  const std::shared_ptr<Session> session_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_USE_H_
