#include "client/console/console.h"

#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/console/mesh_upload.h"
#include "client/console/parameter_form.h"
#include "client/files/mesh_file.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/output_file.h"
#include "client/formats/io/temporary_folder.h"
#include "client/formats/io/zip_file.h"
#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"
#include "client/json/statistics.h"
#include "client/overview.h"
#include "client/viewer/page.h"
#include "core/base/status_macros.h"

// The page as it was built, in this program: wellspace_embed.
extern "C" const char wellspace_console_page_begin[];
extern "C" const char wellspace_console_page_end[];

namespace wellspace::console {
namespace {

using client::Json;

constexpr char kSessions[] = "sessions/";
constexpr char kApi[] = "api/";
constexpr size_t kMostSessions = 500;    // that the page lists
constexpr size_t kMostTimes = 1000;      // operations whose time is kept
constexpr size_t kPieceBytes = 1 << 20;  // of a file that goes into an archive
constexpr char kHtml[] = "text/html; charset=utf-8";

int StatusOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
      return 400;
    case absl::StatusCode::kUnauthenticated:
    case absl::StatusCode::kPermissionDenied:
      return 403;
    case absl::StatusCode::kNotFound:
      return 404;
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kAborted:
      return 409;
    case absl::StatusCode::kResourceExhausted:
      return 429;
    case absl::StatusCode::kUnavailable:
    case absl::StatusCode::kDeadlineExceeded:
    case absl::StatusCode::kCancelled:
      return 503;
    default:
      return 500;
  }
}

HttpAnswer JsonAnswer(int status, const Json& json) {
  return {.status = status, .body = client::JsonText(json, /*indented=*/false)};
}

std::string ValueOf(const HttpRequest& request, const std::string& name) {
  const auto found = request.query.find(name);
  return found == request.query.end() ? "" : found->second;
}

absl::Status NoSuchPath(const HttpRequest& request) {
  return absl::NotFoundError(absl::StrCat("the console knows no ", request.method, " of this path"));
}

// Ends a download with the header: nothing else is wanted of the mesh.
class HeaderSink final : public client::MeshSink {
 public:
  absl::Status Begin(const client::MeshHeader& header) override {
    header_ = header;
    return absl::CancelledError("the header is there");
  }
  absl::Status AddPoints(std::span<const double> /*points*/) override { return absl::OkStatus(); }
  absl::Status AddWeights(std::span<const double> /*weights*/) override { return absl::OkStatus(); }
  absl::Status AddSimplices(std::span<const uint32_t> /*simplices*/) override { return absl::OkStatus(); }
  absl::Status AddInputVertices(std::span<const uint32_t> /*vertices*/) override { return absl::OkStatus(); }
  absl::Status Finish() override { return absl::OkStatus(); }

  const std::optional<client::MeshHeader>& header() const { return header_; }

 private:
  std::optional<client::MeshHeader> header_;
};

// A name in the folder that no other file has.
absl::StatusOr<std::string> NewFile(const std::string& folder) {
  std::string path = absl::StrCat(folder, "/answer-XXXXXX");
  const int file = mkstemp(path.data());
  if (file < 0) {
    return absl::ResourceExhaustedError("no file can be made for the answer");
  }
  close(file);
  return path;
}

// Puts all files of a folder into the archive `path`, by their names.
absl::Status WriteArchive(const std::string& folder, const std::string& path, const std::stop_token& stop) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    files.push_back(entry.path());
  }
  if (error) {
    return absl::InternalError(absl::StrCat("the files of the mesh cannot be listed: ", error.message()));
  }
  std::sort(files.begin(), files.end());
  WELLSPACE_ASSIGN_OR_RETURN(formats::OutputFile output, formats::OutputFile::Create(path, stop));
  formats::ZipWriter archive(output);
  std::string piece;
  for (const std::filesystem::path& name : files) {
    WELLSPACE_ASSIGN_OR_RETURN(formats::InputFile file, formats::InputFile::Open(name.string()));
    archive.Begin(name.filename().string(), file.size().value_or(0));
    for (size_t got = 1; got > 0 && archive.status().ok();) {
      piece.resize(kPieceBytes);
      WELLSPACE_ASSIGN_OR_RETURN(got, file.Read(piece.data(), piece.size()));
      archive.Write(std::string_view(piece).substr(0, got));
    }
  }
  WELLSPACE_RETURN_IF_ERROR(archive.Finish());
  return output.Commit();
}

HttpAnswer FileAnswer(const std::string& path, const std::string& name) {
  return {.type = "application/octet-stream",
          .file = path,
          .headers = {{"Content-Disposition", absl::StrCat("attachment; filename=\"", SafeFileName(name), "\"")}}};
}

}  // namespace

Console::Console(client::Client client, ConsoleOptions options)
    : client_(std::move(client)), options_(std::move(options)) {}

client::CallOptions Console::Call() const {
  // The page asks again; work that was begun goes on.
  constexpr absl::Duration kPatience = absl::Minutes(10);
  client::CallOptions call;
  call.timeout = kPatience;
  call.stop = options_.stop;
  return call;
}

client::CallOptions Console::Look() const {
  // A server that is gone is told soon, and asked again by the page.
  constexpr absl::Duration kPatience = absl::Seconds(5);
  client::CallOptions call = Call();
  call.timeout = kPatience;
  return call;
}

HttpAnswer Console::Answer(const HttpRequest& request) {
  absl::StatusOr<HttpAnswer> answer = AnswerOrError(request);
  return answer.ok() ? *std::move(answer) : JsonAnswer(StatusOf(answer.status()), client::ErrorJson(answer.status()));
}

absl::StatusOr<HttpAnswer> Console::AnswerOrError(const HttpRequest& request) {
  const auto json = [](const absl::StatusOr<Json>& value) -> absl::StatusOr<HttpAnswer> {
    return value.ok() ? absl::StatusOr<HttpAnswer>(JsonAnswer(200, *value)) : value.status();
  };
  const bool is_get = request.method == "GET";
  if (is_get && request.path.empty()) {
    return HttpAnswer{.type = kHtml,
                      .body = std::string(wellspace_console_page_begin, wellspace_console_page_end),
                      .headers = {{kPolicyHeader, "frame-ancestors 'none'"}}};
  }
  if (is_get && request.path == "api/server") {
    return json(ServerFigures());
  }
  if (is_get && request.path == "api/form") {
    return json(ParameterForm());
  }
  if (is_get && request.path == "api/sessions") {
    return json(Sessions());
  }
  if (request.method == "POST" && request.path == "api/sessions") {
    return json(Upload(request));
  }
  return AnswerOfSession(request, request.path);
}

absl::StatusOr<HttpAnswer> Console::AnswerOfSession(const HttpRequest& request, std::string_view path) {
  const bool is_api = path.starts_with(kApi);
  path.remove_prefix(is_api ? sizeof(kApi) - 1 : 0);
  if (!path.starts_with(kSessions)) {
    return NoSuchPath(request);
  }
  const size_t end = path.find('/', sizeof(kSessions) - 1);
  const std::string session(path.substr(0, end));
  const std::string what = end == path.npos ? "" : std::string(path.substr(end + 1));
  const bool is_get = request.method == "GET";
  const bool is_post = request.method == "POST";
  if (!is_api) {
    return is_get && what == "view"   ? View(session)
           : is_get && what == "mesh" ? Mesh(session, ValueOf(request, "format"))
                                      : NoSuchPath(request);
  }
  absl::StatusOr<Json> answer = NoSuchPath(request);
  if (request.method == "DELETE" && what.empty()) {
    WELLSPACE_RETURN_IF_ERROR(client_.DeleteSession(session, Call()));
    answer = Json::object();
  } else if (is_post && what == "refine") {
    answer = Refine(session, request);
  } else if (is_post && what == "cancel") {
    answer = Cancel(session);
  } else if (is_get && what == "statistics") {
    answer = Statistics(session);
  }
  return answer.ok() ? absl::StatusOr<HttpAnswer>(JsonAnswer(200, *answer)) : answer.status();
}

absl::StatusOr<Json> Console::ServerFigures() {
  WELLSPACE_ASSIGN_OR_RETURN(const client::ServerInfo info, client_.GetServerInfo(Look()));
  // A proxy may pass the other services alone: the page has the rest all the same.
  const absl::StatusOr<client::Health> health = client_.CheckHealth("", Look());
  return Json{{"server", options_.server.empty() ? Json(nullptr) : Json(options_.server)},
              {"info", client::ServerInfoJson(info)},
              {"health", client::HealthName(health.value_or(client::Health::kUnknown))},
              {"formats", FormatsByDimension(info.dimensions)}};
}

Json Console::FormatsByDimension(std::span<const int> dimensions) const {
  Json found = Json::object();
  for (const int dimension : dimensions) {
    Json& names = found[absl::StrCat(dimension)] = Json::array();
    for (const std::string& format : formats::MeshFormats()) {
      const std::string path = absl::StrCat(options_.folder, "/mesh", formats::ExtensionOfMesh(format));
      if (formats::CheckMeshOutput(path, format, dimension).ok()) {
        names.push_back(format);
      }
    }
  }
  return found;
}

absl::StatusOr<Json> Console::Sessions() {
  WELLSPACE_ASSIGN_OR_RETURN(const client::Overview overview,
                             client::GetOverview(client_, {.most = kMostSessions}, Look()));
  Json sessions = Json::array();
  for (const client::SessionWithOperation& one : overview.sessions) {
    Json& entry = sessions.emplace_back();
    entry["session"] = client::SessionJson(one.session);
    if (one.operation.has_value()) {
      entry["operation"] = client::OperationJson(*one.operation);
      entry["seconds_left"] = SecondsLeft(*one.operation);
    }
  }
  return Json{{"sessions", sessions}, {"more", overview.has_more}};
}

Json Console::SecondsLeft(const client::Operation& operation) {
  const std::lock_guard lock(mutex_);
  if (client::IsOver(operation.state)) {
    time_left_.erase(operation.name);
    return nullptr;
  }
  if (time_left_.size() >= kMostTimes) {
    time_left_.clear();  // of operations that nothing has asked about since they ended
  }
  const std::optional<absl::Duration> left = time_left_[operation.name].At(operation.progress.fraction, absl::Now());
  return left.has_value() ? Json(absl::ToDoubleSeconds(*left)) : Json(nullptr);
}

absl::StatusOr<Json> Console::Upload(const HttpRequest& request) {
  WELLSPACE_ASSIGN_OR_RETURN(const client::MeshOptions parameters,
                             ParametersOf(ValueOf(request, "parameters"), client::MeshOptions()));
  const std::string crossings = ValueOf(request, "crossings");
  if (!crossings.empty() && crossings != "refuse" && crossings != "snap" && crossings != "split") {
    return absl::InvalidArgumentError("crossings: expected refuse, snap or split");
  }
  const MeshUpload upload{.body_path = request.body_path,
                          .name = ValueOf(request, "name"),
                          .parameters = parameters,
                          .crossings = crossings == "split"  ? client::CrossingRule::kSplit
                                       : crossings == "snap" ? client::CrossingRule::kSnap
                                                             : client::CrossingRule::kRefuse};
  WELLSPACE_ASSIGN_OR_RETURN(const UploadedMesh uploaded, UploadMesh(client_, upload, Call()));
  return Json{{"operation", client::OperationJson(uploaded.operation)}, {"notes", uploaded.notes}};
}

absl::StatusOr<Json> Console::Refine(const std::string& session, const HttpRequest& request) {
  WELLSPACE_ASSIGN_OR_RETURN(const client::Session found, client_.GetSession(session, Call()));
  client::RefinementOptions refinement{.restart = ValueOf(request, "restart") == "true"};
  WELLSPACE_ASSIGN_OR_RETURN(refinement.parameters, ParametersOf(ValueOf(request, "parameters"), found.parameters));
  WELLSPACE_ASSIGN_OR_RETURN(const client::Operation started, client_.StartRefinement(session, refinement, Call()));
  return Json{{"operation", client::OperationJson(started)}};
}

absl::StatusOr<Json> Console::Cancel(const std::string& session) {
  WELLSPACE_ASSIGN_OR_RETURN(const client::Session found, client_.GetSession(session, Call()));
  if (found.last_operation.empty()) {
    return absl::FailedPreconditionError(absl::StrCat(session, " has no operation that could be cancelled"));
  }
  WELLSPACE_ASSIGN_OR_RETURN(const client::Operation cancelled, client_.CancelOperation(found.last_operation, Call()));
  return Json{{"operation", client::OperationJson(cancelled)}};
}

absl::StatusOr<Json> Console::Statistics(const std::string& session) {
  HeaderSink sink;
  const absl::Status status = client_.DownloadMesh(session, sink, std::nullopt, nullptr, Call());
  if (!sink.header().has_value()) {
    return status;
  }
  return client::StatisticsJson(*sink.header(), {});
}

absl::StatusOr<HttpAnswer> Console::View(const std::string& session) {
  WELLSPACE_ASSIGN_OR_RETURN(const client::Session found, client_.GetSession(session, Call()));
  WELLSPACE_ASSIGN_OR_RETURN(const HttpAnswer file, Mesh(session, "npz"));
  absl::StatusOr<formats::Mesh> mesh = formats::ReadMesh(file.file);
  unlink(file.file.c_str());
  WELLSPACE_RETURN_IF_ERROR(mesh.status());
  WELLSPACE_RETURN_IF_ERROR(viewer::CheckMesh(mesh->View()));
  WELLSPACE_ASSIGN_OR_RETURN(const std::string path, NewFile(options_.folder));
  WELLSPACE_ASSIGN_OR_RETURN(formats::OutputFile page, formats::OutputFile::Create(path));
  const auto name = found.labels.find("file");
  viewer::WritePage(mesh->View(), {.name = name == found.labels.end() ? session : name->second}, page);
  WELLSPACE_RETURN_IF_ERROR(page.Commit());
  return HttpAnswer{.type = kHtml, .file = path, .headers = {{kPolicyHeader, "frame-ancestors 'self'"}}};
}

absl::StatusOr<HttpAnswer> Console::Mesh(const std::string& session, const std::string& format) {
  const std::vector<std::string> formats = formats::MeshFormats();
  if (std::find(formats.begin(), formats.end(), format) == formats.end()) {
    return absl::InvalidArgumentError("format: expected the name of one that is listed");
  }
  // Files that name each other do so by these names.
  WELLSPACE_ASSIGN_OR_RETURN(const formats::TemporaryFolder folder, formats::TemporaryFolder::Make());
  const std::string name = absl::StrCat("mesh", formats::ExtensionOfMesh(format));
  const std::string made = absl::StrCat(folder.path(), "/", name);
  client::MeshFile file(made, format, options_.stop);
  if (const absl::Status status = client_.DownloadMesh(session, file, std::nullopt, nullptr, Call()); !status.ok()) {
    return WithoutFolder(status, folder);
  }
  const bool is_alone = formats::FilesOfMeshWritten(made, format).size() == 1;
  WELLSPACE_ASSIGN_OR_RETURN(const std::string path, NewFile(options_.folder));
  const std::string extended = path + (is_alone ? formats::ExtensionOfMesh(format) : ".zip");
  unlink(path.c_str());
  if (!is_alone) {
    WELLSPACE_RETURN_IF_ERROR(WriteArchive(folder.path(), extended, options_.stop));
    return FileAnswer(extended, absl::StrCat(name, ".zip"));
  }
  if (std::rename(made.c_str(), extended.c_str()) != 0) {
    return absl::InternalError(absl::StrCat("the mesh cannot be moved: ", std::strerror(errno)));
  }
  return FileAnswer(extended, name);
}

}  // namespace wellspace::console
