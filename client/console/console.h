// The console: the requests of the page in the browser, answered by calls of a client.
#ifndef WELLSPACE_CLIENT_CONSOLE_CONSOLE_H_
#define WELLSPACE_CLIENT_CONSOLE_CONSOLE_H_

#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client/client.h"
#include "client/console/http_server.h"
#include "client/json/json.h"
#include "client/time_left.h"

namespace wellspace::console {

struct ConsoleOptions {
  std::string server{};    // as the page calls it; empty: the server is in this process
  std::string folder{};    // for files on their way; of this user alone
  std::stop_token stop{};  // ends the calls that are under way
};

// Paths, under the prefix of the guard:
//
//   GET                                      the page
//   GET    api/server                        {info, health, server, formats: {DIMENSION: [format]}}
//   GET    api/form                          see ParameterForm
//   GET    api/sessions                      {sessions: [{session, operation, seconds_left}], more}
//   POST   api/sessions?name=&parameters=&crossings=    the body is a file; {operation, notes}
//   POST   api/sessions/ID/refine?parameters=           {operation}
//   POST   api/sessions/ID/cancel            cancels the last operation; {operation}
//   DELETE api/sessions/ID
//   GET    api/sessions/ID/statistics        see StatisticsJson
//   GET    sessions/ID/view                  the page of its mesh, see client/viewer
//   GET    sessions/ID/mesh?format=          its mesh; of a format of several files an archive of them, a .zip
//
// An error is {code, reason, field, message}, as ErrorJson has it.
//
// Thread safety: thread-safe.
class Console {
 public:
  Console(client::Client client, ConsoleOptions options);

  HttpAnswer Answer(const HttpRequest& request);

 private:
  absl::StatusOr<HttpAnswer> AnswerOrError(const HttpRequest& request);
  absl::StatusOr<HttpAnswer> AnswerOfSession(const HttpRequest& request, std::string_view path);
  absl::StatusOr<client::Json> ServerFigures();
  absl::StatusOr<client::Json> Sessions();
  absl::StatusOr<client::Json> Upload(const HttpRequest& request);
  absl::StatusOr<client::Json> Refine(const std::string& session, const HttpRequest& request);
  absl::StatusOr<client::Json> Cancel(const std::string& session);
  absl::StatusOr<client::Json> Statistics(const std::string& session);
  absl::StatusOr<HttpAnswer> View(const std::string& session);
  absl::StatusOr<HttpAnswer> Mesh(const std::string& session, const std::string& format);
  client::Json FormatsByDimension(std::span<const int> dimensions) const;
  client::Json SecondsLeft(const client::Operation& operation);
  client::CallOptions Call() const;
  client::CallOptions Look() const;  // for what the page asks again and again

  client::Client client_;
  const ConsoleOptions options_;
  std::mutex mutex_;
  std::map<std::string, client::TimeLeft> time_left_;  // of operations that run; guarded by mutex_
};

}  // namespace wellspace::console

#endif  // WELLSPACE_CLIENT_CONSOLE_CONSOLE_H_
