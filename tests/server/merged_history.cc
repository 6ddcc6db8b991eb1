#include "tests/server/merged_history.h"

#include <map>
#include <pqxx/pqxx>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {
namespace {

constexpr char kTriggers[] = R"(
CREATE SCHEMA history;
CREATE TABLE history.writes(number bigserial PRIMARY KEY, kind integer NOT NULL, place text NOT NULL, session text,
                            epoch bigint, owner bigint, record bytea, operation bigint, request_id text);
CREATE FUNCTION history.note() RETURNS trigger LANGUAGE plpgsql AS $$
DECLARE
  place text := coalesce(host(inet_client_addr()), '');
BEGIN
  IF TG_TABLE_NAME = 'answers' THEN
    INSERT INTO history.writes(kind, place, request_id) VALUES(4, place, convert_from(NEW.request_id, 'UTF8'));
  ELSIF TG_TABLE_NAME = 'sessions' AND TG_OP = 'DELETE' THEN
    INSERT INTO history.writes(kind, place, session, epoch, owner) VALUES(3, place, OLD.name, OLD.epoch, OLD.owner);
  ELSIF TG_TABLE_NAME = 'sessions' THEN
    INSERT INTO history.writes(kind, place, session, epoch, owner, record)
      VALUES(0, place, NEW.name, NEW.epoch, NEW.owner, NEW.state);
  ELSIF TG_TABLE_NAME = 'operations' THEN
    INSERT INTO history.writes(kind, place, session, epoch, owner, operation)
      SELECT 2, place, name, epoch, owner, NEW.number FROM wellspace.sessions WHERE id = NEW.session;
  ELSE
    INSERT INTO history.writes(kind, place, session, epoch, owner)
      SELECT 1, place, name, epoch, owner FROM wellspace.sessions WHERE id = NEW.session;
  END IF;
  RETURN NULL;
END $$;
CREATE TRIGGER note AFTER INSERT OR UPDATE OR DELETE ON wellspace.sessions
  FOR EACH ROW EXECUTE FUNCTION history.note();
CREATE TRIGGER note AFTER INSERT OR UPDATE ON wellspace.operations FOR EACH ROW EXECUTE FUNCTION history.note();
CREATE TRIGGER note AFTER INSERT OR UPDATE ON wellspace.steps FOR EACH ROW EXECUTE FUNCTION history.note();
CREATE TRIGGER note AFTER INSERT ON wellspace.answers FOR EACH ROW EXECUTE FUNCTION history.note();
)";

// The writes of a session, in their order.
struct SessionWrites {
  int64_t epoch = 0;
  uint64_t revision = 0;
  bool is_deleted = false;
  std::map<int64_t, int64_t> owners;  // by epoch
  std::set<uint64_t> revisions;
  std::set<int64_t> operations;
};

struct Committed {
  std::map<std::string, SessionWrites> sessions;
  std::map<std::string, int> answers;     // by request
  std::map<int64_t, std::string> places;  // by owner
};

std::string AddWrite(const DatabaseWrite& write, Committed& committed) {
  if (write.of == DatabaseWrite::Of::kAnswer) {
    return ++committed.answers[write.request_id] == 1
               ? ""
               : absl::StrCat("request ", write.request_id, " was answered twice");
  }
  SessionWrites& session = committed.sessions[write.session];
  const std::string& place = committed.places.emplace(write.owner, write.place).first->second;
  const int64_t owner = session.owners.emplace(write.epoch, write.owner).first->second;
  if (write.epoch < session.epoch) {
    return absl::StrCat(write.session, ": a write of epoch ", write.epoch, " comes after one of ", session.epoch);
  }
  if (owner != write.owner) {
    return absl::StrCat(write.session, ": owners ", owner, " and ", write.owner, " both have epoch ", write.epoch);
  }
  if (place != write.place) {
    return absl::StrCat(write.session, ": what owner ", owner, " at ", place, " has is written by ", write.place);
  }
  if (session.is_deleted) {
    return absl::StrCat(write.session, ": it is written after its deletion");
  }
  session.epoch = write.epoch;
  if (write.of == DatabaseWrite::Of::kSession) {
    if (write.revision < session.revision) {
      return absl::StrCat(write.session, ": revision ", session.revision, " goes back to ", write.revision);
    }
    session.revision = write.revision;
    session.revisions.insert(write.revision);
  } else if (write.of == DatabaseWrite::Of::kOperation) {
    session.operations.insert(write.number);
  } else if (write.of == DatabaseWrite::Of::kDeletion) {
    session.is_deleted = true;
  }
  return "";
}

// What clients know of a session.
struct ToldOfSession {
  bool is_created = false;
  bool is_deleted = false;
  size_t operations = 0;
};

std::string AddTold(const Acknowledgement& told, const Committed& committed,
                    std::map<std::string, ToldOfSession>& sessions) {
  ToldOfSession& known = sessions[told.session];
  known.is_created |= told.of == Acknowledgement::Of::kCreation;
  known.is_deleted |= told.of == Acknowledgement::Of::kDeletion;
  known.operations += told.of == Acknowledgement::Of::kOperation ? 1 : 0;
  const auto found = committed.sessions.find(told.session);
  if (found == committed.sessions.end()) {
    return absl::StrCat(told.session, " is lost");
  }
  if (told.revision != 0 && !found->second.revisions.contains(told.revision)) {
    return absl::StrCat(told.session, ": revision ", told.revision, " is lost");
  }
  if (!told.request_id.empty() && !committed.answers.contains(told.request_id)) {
    return absl::StrCat(told.session, ": request ", told.request_id, " is lost");
  }
  return "";
}

}  // namespace

std::string CheckMergedHistory(std::span<const DatabaseWrite> writes, std::span<const Acknowledgement> told) {
  Committed committed;
  for (const DatabaseWrite& write : writes) {
    if (std::string wrong = AddWrite(write, committed); !wrong.empty()) {
      return wrong;
    }
  }
  std::map<std::string, ToldOfSession> sessions;
  for (const Acknowledgement& acknowledgement : told) {
    if (std::string wrong = AddTold(acknowledgement, committed, sessions); !wrong.empty()) {
      return wrong;
    }
  }
  for (const auto& [name, session] : committed.sessions) {
    const ToldOfSession& known = sessions[name];
    if (!known.is_created) {
      return absl::StrCat(name, " was made, and no client was told of it");
    }
    if (session.operations.size() > known.operations) {
      return absl::StrCat(name, ": ", session.operations.size(), " operations were begun, and clients know of ",
                          known.operations);
    }
    if (session.is_deleted != known.is_deleted) {
      return absl::StrCat(name,
                          session.is_deleted ? " was deleted, and no client was told of it" : ": it is not deleted");
    }
  }
  return "";
}

WriteRecorder::WriteRecorder(PostgresServer& server, std::string database)
    : server_(server), database_(std::move(database)) {
  server_.Run(kTriggers, database_);
}

std::vector<DatabaseWrite> WriteRecorder::Read() const {
  pqxx::connection connection(server_.AddressOf(database_));
  pqxx::nontransaction transaction(connection);
  std::vector<DatabaseWrite> writes;
  for (const pqxx::row& row :
       transaction.exec("SELECT kind, place, coalesce(session, ''), coalesce(epoch, 0), coalesce(owner, 0), record,"
                        " coalesce(operation, 0), coalesce(request_id, '') FROM history.writes ORDER BY number")) {
    DatabaseWrite& write = writes.emplace_back(DatabaseWrite{.of = static_cast<DatabaseWrite::Of>(row[0].as<int>()),
                                                             .place = row[1].as<std::string>(),
                                                             .session = row[2].as<std::string>(),
                                                             .epoch = row[3].as<int64_t>(),
                                                             .owner = row[4].as<int64_t>(),
                                                             .revision = 0,
                                                             .number = row[6].as<int64_t>(),
                                                             .request_id = row[7].as<std::string>()});
    if (!row[5].is_null()) {
      store::v1::SessionRecord record;
      const pqxx::binarystring bytes(row[5]);
      EXPECT_TRUE(record.ParseFromArray(bytes.get(), static_cast<int>(bytes.size())));
      write.revision = record.revision();
    }
  }
  return writes;
}

}  // namespace wellspace::server
