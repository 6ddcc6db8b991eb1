// The history of several servers over one PostgreSQL: what the database was made to write, and what clients were told.
#ifndef WELLSPACE_TESTS_SERVER_MERGED_HISTORY_H_
#define WELLSPACE_TESTS_SERVER_MERGED_HISTORY_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tests/server/store/postgres_server.h"

namespace wellspace::server {

// A call that was answered.
struct Acknowledgement {
  enum class Of { kCreation, kChange, kOperation, kDeletion };

  Of of = Of::kChange;
  std::string session{};
  std::string request_id{};  // empty: it had none
  uint64_t revision = 0;     // of the session behind it; 0: it was not told
};

// A row that was committed.
struct DatabaseWrite {
  enum class Of { kSession, kRecord, kOperation, kDeletion, kAnswer };

  Of of = Of::kSession;
  std::string place{};       // where the connection came from
  std::string session{};     // empty: of an answer
  int64_t epoch = 0;         // that the session has had then
  int64_t owner = 0;         // likewise
  uint64_t revision = 0;     // of kSession
  int64_t number = 0;        // of kOperation
  std::string request_id{};  // of kAnswer
};

// What is wrong with a whole history, whose clients have all got their answers; empty: nothing. `writes` are in their
// order for each session.
//
// Guarantees: (1) nothing is lost: each revision and each answer that a client was told was committed, no revision of a
//             session goes back, and nothing but a deletion that was asked for removes one. (2) Nothing is done twice:
//             no request has two answers, no session was made and no operation begun that no client was told of. (3)
//             No owners are interleaved: the epochs of a session never go back, each is of one owner, and each owner
//             writes from one place.
std::string CheckMergedHistory(std::span<const DatabaseWrite> writes, std::span<const Acknowledgement> told);

// Notes all writes to a database from now on, by triggers. In it is one owner's tables already.
class WriteRecorder {
 public:
  // REQUIRES: `server` outlives this.
  WriteRecorder(PostgresServer& server, std::string database);

  std::vector<DatabaseWrite> Read() const;

 private:
  PostgresServer& server_;
  const std::string database_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_MERGED_HISTORY_H_
