#include "client/cli/meshing_options.h"

#include <algorithm>
#include <charconv>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/time.h"
#include "client/cli/exit_codes.h"
#include "client/cli/options.h"
#include "client/cli/server_link.h"
#include "client/formats/output_file.h"
#include "client/formats/read_cloud.h"

namespace wellspace::cli {
namespace {

constexpr char kRadiusEdge[] = "radius-edge";
constexpr char kWellSpaced[] = "well-spaced";

bool IsDimension(size_t dimension) {
  return dimension >= formats::kMinDimension && dimension <= formats::kMaxDimension;
}

// Numbers as they might have been written.
std::string Text(const std::vector<double>& numbers) { return absl::StrJoin(numbers, ","); }

// The server knows points by their index; who wrote the file knows them by their line.
absl::Status WithOrigins(const absl::Status& status, const formats::PointCloud& cloud) {
  constexpr std::string_view kPoint = "points[";
  std::string message(status.message());
  std::string first_origin;
  for (size_t at = message.find(kPoint); at != std::string::npos; at = message.find(kPoint, at)) {
    at += kPoint.size();
    uint64_t point = 0;
    const char* end = message.data() + message.size();
    const std::from_chars_result result = std::from_chars(message.data() + at, end, point);
    if (result.ec != std::errc() || result.ptr == end || *result.ptr != ']' || point >= cloud.size()) {
      continue;
    }
    if (first_origin.empty()) {
      first_origin = cloud.Origin(point);
    } else {
      message.insert(result.ptr + 1 - message.data(), absl::StrCat(" (", cloud.Origin(point), ")"));
    }
  }
  return absl::Status(status.code(), first_origin.empty() ? message : absl::StrCat(first_origin, ": ", message));
}

}  // namespace

const char kCloudsHelp[] =
    "Clouds:  .csv .tsv .txt .dat (columns separated by commas, semicolons or blanks; a header may name x, y, z),\n"
    "         .xyz, .node, .npy; \"-\" is standard input (csv, or --input-format)\n";

CLI::Option* AddCriterion(CLI::App& command, client::Criterion& criterion) {
  return command
      .add_option_function<std::string>(
          "--criterion",
          [&criterion](const std::string& name) {
            criterion = name == kWellSpaced ? client::Criterion::kWellSpaced : client::Criterion::kRadiusEdge;
          },
          "What --rho bounds: radius-edge, circumradius / shortest edge of every simplex; or well-spaced, for every "
          "vertex the farthest node of its Voronoi cell / its nearest neighbour, which is stronger; default: "
          "radius-edge")
      ->check(CLI::IsMember({kRadiusEdge, kWellSpaced}));
}

void AddSizes(CLI::App& command, double& max_circumradius, std::vector<std::vector<double>>& size_boxes) {
  AddNumber(command, "--size", max_circumradius, "Bound on the circumradius of every simplex; default: none");
  AddNumberLists(command, "--size-box", size_boxes,
                 "Low corner, high corner and a bound on the circumradius of every simplex whose circumball meets this "
                 "box; may be given more than once");
}

absl::StatusOr<std::vector<client::SizeBox>> SizeBoxesOf(const std::vector<std::vector<double>>& size_boxes,
                                                         int dimension) {
  std::vector<client::SizeBox> boxes;
  for (const std::vector<double>& numbers : size_boxes) {
    const size_t corner = numbers.size() / 2;
    const bool is_expected = dimension == 0 ? IsDimension(corner) : corner == static_cast<size_t>(dimension);
    if (!is_expected || numbers.size() % 2 == 0) {
      return absl::InvalidArgumentError(absl::StrCat(
          "--size-box ", Text(numbers), ": expected low corner, high corner and size, ",
          dimension == 0 ? absl::StrCat(2 * formats::kMinDimension + 1, " numbers in ", formats::kMinDimension,
                                        "-D to ", 2 * formats::kMaxDimension + 1, " in ", formats::kMaxDimension, "-D")
                         : absl::StrCat(2 * dimension + 1, " numbers in ", dimension, "-D"),
          ", got ", numbers.size()));
    }
    boxes.push_back({.low = {numbers.begin(), numbers.begin() + corner},
                     .high = {numbers.begin() + corner, numbers.end() - 1},
                     .max_circumradius = numbers.back()});
  }
  return boxes;
}

void MeshingOptions::AddTo(CLI::App& command) {
  command.add_option("IN", input_, "File of points, or - for standard input")->required();
  command.add_option("--dimension", dimension_, "Dimension; default: as many as the points have coordinates")
      ->check(CLI::Range(formats::kMinDimension, formats::kMaxDimension));
  AddCriterion(command, options_.criterion);
  AddNumber(command, "--rho", options_.rho,
            "Bound of the criterion; default: that of the dimension, sqrt(2) in 2-D, 2 in 3-D");
  AddSizes(command, options_.max_circumradius, size_boxes_);
  CLI::Option* domain =
      AddNumbers(command, "--domain", domain_, "Box to be meshed, low corner then high corner; default: by --margin");
  AddNumber(command, "--margin", options_.margin,
            "Grow the bounding box of the points on every side by this times its longest side; default: 0.25")
      ->excludes(domain);
  command.add_option("--max-vertices", options_.max_vertices,
                     "Fail before the mesh has more vertices than this; 50 million by default");
  command.add_option("--threads", options_.threads, "Threads that mesh; default: the server's choice")
      ->check(CLI::Range(1, 1024));
  AddServer(command, server_);
  command.add_option("--stats", statistics_, "Write figures as JSON to this file, or - for standard output");
  AddNumber(command, "--timeout", timeout_seconds_, "Give up after so many seconds; default: never")
      ->check(CLI::PositiveNumber);
  command.add_option("--input-format", input_format_, "Format of IN; default: by its extension")
      ->check(CLI::IsMember(formats::CloudFormats()));
  command.add_flag("-q,--quiet", quiet_, "Print errors only");
}

int MeshingOptions::dimension() const {
  if (dimension_ != 0 || !domain_.empty()) {
    return dimension_ != 0 ? dimension_ : static_cast<int>(domain_.size() / 2);
  }
  return size_boxes_.empty() ? 0 : static_cast<int>(size_boxes_.front().size() / 2);
}

absl::Status MeshingOptions::Check() const {
  if (!domain_.empty() && (domain_.size() % 2 != 0 || !IsDimension(domain_.size() / 2))) {
    return absl::InvalidArgumentError(
        absl::StrCat("--domain ", Text(domain_), ": expected low corner and high corner, ", 2 * formats::kMinDimension,
                     " numbers in ", formats::kMinDimension, "-D to ", 2 * formats::kMaxDimension, " in ",
                     formats::kMaxDimension, "-D, got ", domain_.size()));
  }
  if (!domain_.empty() && domain_.size() != 2u * dimension()) {
    return absl::InvalidArgumentError(absl::StrCat("--domain ", Text(domain_), ": expected ", 2 * dimension(),
                                                   " numbers with --dimension ", dimension(), ", got ",
                                                   domain_.size()));
  }
  return SizeBoxesOf(size_boxes_, IsDimension(dimension()) ? dimension() : 0).status();
}

absl::StatusOr<formats::PointCloud> MeshingOptions::Read() {
  absl::StatusOr<formats::PointCloud> cloud =
      formats::ReadCloud(input_, {.format = input_format_, .dimension = dimension()});
  if (!cloud.ok()) {
    return cloud;
  }
  absl::StatusOr<std::vector<client::SizeBox>> boxes = SizeBoxesOf(size_boxes_, cloud->dimension);
  if (!boxes.ok()) {
    return boxes.status();
  }
  options_.dimension = cloud->dimension;
  options_.size_boxes = *std::move(boxes);
  options_.domain_low.assign(domain_.begin(), domain_.begin() + domain_.size() / 2);
  options_.domain_high.assign(domain_.begin() + domain_.size() / 2, domain_.end());
  if (timeout_seconds_ > 0) {
    options_.timeout = absl::Seconds(timeout_seconds_);
  }
  return cloud;
}

std::string MeshingOptions::OptionOf(const std::string& field) const {
  constexpr std::string_view kParameters = "parameters.";
  if (field.compare(0, kParameters.size(), kParameters) != 0) {
    return "";
  }
  const std::string name = field.substr(kParameters.size());
  constexpr std::string_view kSizeBoxes = "size_boxes[";
  size_t index = 0;
  if (name.compare(0, kSizeBoxes.size(), kSizeBoxes) == 0 &&
      std::from_chars(name.data() + kSizeBoxes.size(), name.data() + name.size(), index).ec == std::errc() &&
      index < size_boxes_.size()) {
    return absl::StrCat("--size-box ", Text(size_boxes_[index]));
  }
  if (name == "max_circumradius") {
    return "--size";
  }
  std::string option = "--" + name;
  std::replace(option.begin(), option.end(), '_', '-');
  return option;
}

absl::Status MeshingOptions::Explain(const absl::Status& status, const formats::PointCloud& cloud) const {
  if (status.code() == absl::StatusCode::kInvalidArgument) {
    const std::string option = OptionOf(client::BlamedField(status));
    return option.empty() ? WithOrigins(status, cloud)
                          : absl::InvalidArgumentError(absl::StrCat(option, ": ", status.message()));
  }
  if (status.code() == absl::StatusCode::kDeadlineExceeded && timeout_seconds_ > 0) {
    return absl::DeadlineExceededError(absl::StrCat("--timeout: ", timeout_seconds_, " seconds passed"));
  }
  return status;
}

int MeshingOptions::Run(const Work& work) {
  const absl::StatusOr<formats::PointCloud> cloud = Read();
  if (!cloud.ok()) {
    return ReportError(cloud.status());
  }
  Interrupt interrupt;
  absl::StatusOr<std::unique_ptr<ServerLink>> link = ServerLink::Open(server_);
  if (!link.ok()) {
    return ReportError(link.status());
  }
  const absl::Status status = work((*link)->client(), options_, *cloud, interrupt);
  if (status.ok()) {
    return kExitOk;
  }
  const int exit_code = ReportError((*link)->Explain(Explain(status, *cloud)));
  return interrupt.signal() != 0 ? kExitSignal + interrupt.signal() : exit_code;
}

absl::Status MeshingOptions::WriteStatistics(const std::string& json) const {
  if (statistics_.empty()) {
    return absl::OkStatus();
  }
  absl::StatusOr<formats::OutputFile> file = formats::OutputFile::Create(statistics_);
  if (!file.ok()) {
    return file.status();
  }
  file->Write(json);
  return file->Commit();
}

}  // namespace wellspace::cli
