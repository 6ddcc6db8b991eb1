// The statements of SessionTables. For its files alone.
#ifndef WELLSPACE_SERVER_STORE_SESSION_STATEMENTS_H_
#define WELLSPACE_SERVER_STORE_SESSION_STATEMENTS_H_

#include "server/store/record_keys.h"
#include "server/store/session_tables.h"

namespace wellspace::server {

struct SessionTables::Statements {
  SqliteStatement begin, commit, rollback;
  SqliteStatement read_epochs, write_epochs;
  SqliteStatement find_session, find_id, insert_session, update_session, delete_session, read_session, take_session;
  SqliteStatement next_step, insert_step, delete_steps, read_features;
  SqliteStatement put_operation, drop_operation, delete_operations;
  SqliteStatement insert_sizes, read_sizes, drop_sizes, delete_sizes;
  SqliteStatement put_answer, read_answer, drop_answer;
  SqliteStatement put_usage, find_usage, read_usage;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_SESSION_STATEMENTS_H_
