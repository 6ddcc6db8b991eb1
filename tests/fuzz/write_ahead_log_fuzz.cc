// A write-ahead log and its mark, whatever their bytes are: an answer, and none that takes a log for whole which is
// shorter than its mark says.
//
// Input: a length of two bytes, low one first, the mark of that length, then the log.
#include <string>

#include "server/store/write_ahead_log.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace;  // NOLINT
  fuzz::ByteReader input(data, size);
  const fuzz::ScratchFolder& folder = fuzz::ScratchFolder::Get();
  const std::string_view mark = input.TakeBlock();
  const std::string_view log = input.TakeText();
  const std::string database = folder.Path("sessions.db");
  folder.Write("sessions.db-mark", mark);
  folder.Write("sessions.db-wal", log);
  const absl::StatusOr<std::string> damage = server::FindLogDamage(server::PosixFileSystem(), database);
  fuzz::Require(damage.ok(), "a log that can be read is judged");
  if (!damage->empty()) {
    fuzz::RequireClearMessage(*damage);
  }
  const auto needed = server::LogMark::Read(server::PosixFileSystem(), database);
  fuzz::Require(needed.ok(), "a mark that can be read is judged");
  const uint64_t frames = needed->has_value() ? (*needed)->frames : 0;
  fuzz::Require(frames == 0 || (*needed)->is_in_database || !damage->empty() || 32 + frames * 536 <= log.size(),
                "what the mark needs is there");
  return 0;
}
