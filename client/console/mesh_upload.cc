#include "client/console/mesh_upload.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/error_details.h"
#include "client/files/cloud_file.h"
#include "client/files/domain_features.h"
#include "client/files/surface_features.h"
#include "client/formats/domain/read_planar_domain.h"
#include "client/formats/io/temporary_folder.h"
#include "client/formats/surface/read_surface.h"
#include "client/point_source.h"
#include "client/printable.h"
#include "core/base/status_macros.h"

namespace wellspace::console {
namespace {

constexpr char kFileLabel[] = "file";
constexpr size_t kMaxNameBytes = 100;
constexpr size_t kMaxLabelBytes = 200;

// The part of the name that the page shows.
std::string LabelOf(const std::string& name) {
  std::string label = client::Printable(name.substr(name.find_last_of("/\\") + 1));
  if (label.size() > kMaxLabelBytes) {
    size_t end = kMaxLabelBytes;
    while (end > 0 && (static_cast<unsigned char>(label[end]) & 0xC0) == 0x80) {
      --end;  // not within a character
    }
    label.resize(end);
  }
  return label;
}

// The content of a file for a session.
struct Input {
  int dimension = 0;
  std::unique_ptr<client::CloudFile> cloud;  // null: points, and one of the others
  std::vector<double> points;
  std::optional<client::Features> domain;
  std::optional<client::SurfaceFeatures> surface;
  std::vector<std::string> notes;
};

absl::StatusOr<Input> Read(const std::string& path, client::CrossingRule crossings) {
  Input input;
  if (formats::IsSurfacePath(path)) {  // before domains: .poly may be either
    WELLSPACE_ASSIGN_OR_RETURN(formats::Surface surface, formats::ReadSurface(path));
    input.dimension = 3;
    input.notes = surface.notes;
    input.surface = client::FeaturesOf(surface, {}, input.notes);
    input.points = std::move(surface.points);
    return input;
  }
  if (formats::IsDomainPath(path)) {
    WELLSPACE_ASSIGN_OR_RETURN(formats::PlanarDomain domain, formats::ReadPlanarDomain(path));
    input.dimension = 2;
    input.notes = domain.notes;
    input.domain = client::FeaturesOf(domain, std::nullopt, input.notes);
    input.domain->crossings = crossings;
    input.points = std::move(domain.points);
    return input;
  }
  WELLSPACE_ASSIGN_OR_RETURN(input.cloud, client::CloudFile::Open(path));
  input.dimension = input.cloud->dimension();
  input.notes = input.cloud->notes();
  return input;
}

absl::StatusOr<client::Operation> Fill(client::Client& client, const std::string& session, Input& input,
                                       const client::CallOptions& call) {
  if (input.cloud != nullptr) {
    WELLSPACE_RETURN_IF_ERROR(client.UploadPoints(session, *input.cloud, 0, nullptr, call).status());
  } else {
    client::SpanSource points(input.dimension, input.points);
    WELLSPACE_RETURN_IF_ERROR(client.UploadPoints(session, points, 0, nullptr, call).status());
  }
  if (input.domain.has_value()) {
    WELLSPACE_RETURN_IF_ERROR(client.AddSegments(session, *input.domain, client::FeatureOffset(), call).status());
  }
  if (input.surface.has_value()) {
    WELLSPACE_RETURN_IF_ERROR(client.AddTriangles(session, *input.surface, client::SurfaceOffset(), call).status());
  }
  return client.StartRefinement(session, {}, call);
}

}  // namespace

std::string SafeFileName(std::string_view name) {
  std::string safe(name.substr(name.find_last_of("/\\") + 1));
  for (char& c : safe) {
    if (!absl::ascii_isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-' && c != '_') {
      c = '_';
    }
  }
  if (safe.size() > kMaxNameBytes) {
    safe = safe.substr(safe.size() - kMaxNameBytes);
  }
  return safe.empty() || safe[0] == '.' || safe[0] == '-' ? absl::StrCat("file", safe) : safe;
}

absl::Status WithoutFolder(const absl::Status& status, const formats::TemporaryFolder& folder) {
  return client::WithMessage(status, absl::StrReplaceAll(status.message(), {{absl::StrCat(folder.path(), "/"), ""}}));
}

absl::StatusOr<UploadedMesh> UploadMesh(client::Client& client, const MeshUpload& upload,
                                        const client::CallOptions& call) {
  WELLSPACE_ASSIGN_OR_RETURN(const formats::TemporaryFolder folder, formats::TemporaryFolder::Make());
  const std::string path = absl::StrCat(folder.path(), "/", SafeFileName(upload.name));
  if (upload.body_path.empty() || std::rename(upload.body_path.c_str(), path.c_str()) != 0) {
    return upload.body_path.empty()
               ? absl::InvalidArgumentError(
                     "the file is empty; a file of points, of a domain or of a surface is expected")
               : absl::InternalError(absl::StrCat("the file cannot be moved: ", std::strerror(errno)));
  }
  absl::StatusOr<Input> input = Read(path, upload.crossings);
  if (!input.ok()) {
    return WithoutFolder(input.status(), folder);
  }
  client::SessionOptions options;
  options.parameters = upload.parameters;
  options.labels = {{kFileLabel, LabelOf(upload.name)}};
  options.parameters.dimension = input->dimension;
  WELLSPACE_ASSIGN_OR_RETURN(const client::Session session, client.CreateSession(options, call));
  absl::StatusOr<client::Operation> started = Fill(client, session.name, *input, call);
  if (!started.ok()) {
    (void)client.DeleteSession(session.name);  // its lease ends it, should this fail
    return WithoutFolder(started.status(), folder);
  }
  for (std::string& note : input->notes) {
    note = absl::StrReplaceAll(note, {{absl::StrCat(folder.path(), "/"), ""}});
  }
  return UploadedMesh{.operation = *std::move(started), .notes = std::move(input->notes)};
}

}  // namespace wellspace::console
