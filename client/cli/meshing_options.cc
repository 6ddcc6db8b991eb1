#include "client/cli/meshing_options.h"

#include <iostream>

#include "client/cli/helpful_threads.h"
#include "client/cli/mesh_paths.h"
#include "client/cli/options.h"
#include "client/formats/domain/read_planar_domain.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/output_file.h"
#include "client/formats/read_cloud.h"
#include "client/formats/write_mesh.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {

const char kCloudsHelp[] =
    "Clouds:  .csv .tsv .txt .dat (columns separated by commas, semicolons or blanks; a header may name x, y, z, or\n"
    "         lon, lat and the like), .xyz, .asc, .pts, .node, .npy, .pcd, .las, vertices of .ply, .obj, .off, .stl,\n"
    "         .vtk, .vtp, .vts, .vtu, .vtr, .vti, these of pieces (.pvtu), .msh, .mesh, .14, .2dm and .npz; each but\n"
    "         .npz may be compressed (.csv.gz); \"-\" is standard input (csv, or --input-format)\n"
    "Domains: in 2-D, .poly (Triangle's, with .node), .geojson, .geojsonl, .ndjson, .wkt and .shp; with --segments\n"
    "         lines of .obj, polylines of .csv and boundaries of .14 (ADCIRC)\n"
    "         in 3-D, the inside of a surface: .stl (--as-points: a cloud), .smesh and 3-D .poly (TetGen's);\n"
    "         faces of .obj, .ply and .off with --triangles\n";

const char kMeshesHelp[] =
    "Meshes:  .vtu, .vtkhdf, .vtk, .xdmf (with .h5), .msh (Gmsh 4.1; --format msh22: 2.2), .mesh (MEDIT), .su2 and\n"
    "         .inp (Abaqus), 2-D and 3-D; .npz (arrays of numpy), .node and .ele, with .edge or .face, and .poly;\n"
    "         .14 (ADCIRC) and .2dm (SMS), 2-D;\n"
    "         \"-\" is standard output (vtu).\n"
    "         Each has the boundary: the faces xmin, xmax, ymin, ... of the box are tagged 1, 2, 3, ...\n";

std::vector<std::string> InputFormats() {
  std::vector<std::string> formats = formats::DomainOnlyFormats();
  formats.emplace_back("smesh");
  return formats;
}

absl::Status MeshOutput::Check(int dimension, bool may_have_weights) const {
  return cli::CheckMeshOutput(path, format, dimension, may_have_weights, order);
}

void AddMeshOrder(CLI::App& command, formats::MeshOrder& order) {
  AddCount(
      command, "--order", [&order](uint64_t value) { order = static_cast<formats::MeshOrder>(value); },
      "Order of the elements: 2 gives them a node at the middle of each edge, behind the vertices, for triangles and "
      "tetrahedra of .vtu, .vtkhdf, .vtk, .xdmf, .msh, .inp, .npz and .ele; the edges stay straight; default: 1",
      1, 2);
}

void AddMeshOutput(CLI::App& command, MeshOutput& output) {
  command.add_option("-o,--out", output.path, "File of the mesh, or - for standard output")
      ->required()
      ->type_name("FILE");
  command.add_option("--format", output.format, "Format of the mesh; default: by the extension of its file")
      ->check(CLI::IsMember(formats::MeshFormats()));
  AddMeshOrder(command, output.order);
  command.add_flag(
      "--no-boundary", output.no_boundary,
      "Leave out the boundary (facets of the faces xmin, xmax, ymin, ... with tags 1, 2, 3, ...), regions and "
      "origins of vertices");
}

void AddNoAttributes(CLI::App& command, bool& no_attributes) {
  command.add_flag(
      "--no-attributes", no_attributes,
      "Leave out what points have beside coordinates (intensity, colour, id, named columns), which .vtu, .vtkhdf, "
      ".vtk, "
      ".xdmf and .npz have as data of vertices otherwise, NaN where the mesher added one; --no-boundary leaves it out, "
      "too");
}

void MeshingOptions::AddTo(CLI::App& command) {
  command.add_option("IN", input_, "File of points, of a domain or of a surface, or - for standard input")
      ->required()
      ->type_name("FILE");
  surface_.AddMoreTo(command, "IN");
  parameters_.AddSpaceTo(command);
  parameters_.AddQualityTo(command);
  remote_.AddTo(command, RemoteCommand::Needs::kAnyServer);
  command.add_option("--stats", statistics_, "Write figures as JSON to this file, or - for standard output")
      ->type_name("FILE");
  AddCloudOptions(command, cloud_options_, "IN", InputFormats());
  domain_.AddTo(command);
  surface_.AddMeshingTo(command, "IN");
  part_names_.AddTo(command);
  size_field_.AddTo(command);
}

bool MeshingOptions::has_figures_on_stdout() const { return statistics_ == formats::kStandardStream || remote_.json(); }

absl::Status MeshingOptions::Check() const {
  WELLSPACE_RETURN_IF_ERROR(part_names_.Check());
  return parameters_.Check();
}

void MeshingOptions::AddFilesTo(formats::FilePlan& files) const {
  files.Reads("IN", input_);
  surface_.AddFilesTo(files);
  size_field_.AddFilesTo(files);
  remote_.AddFilesTo(files);
  files.Writes("--stats", statistics_);
  if (remote_.json() && statistics_ != formats::kStandardStream) {
    files.Writes("--output json", std::string(formats::kStandardStream));
  }
}

absl::StatusOr<formats::PointCloud> MeshingOptions::Read() {
  const bool is_surface = surface_.IsSurface(input_, cloud_options_, SurfaceOptions::Poly::kByPath);
  surface_.SetNames(part_names_.names());
  domain_.SetNames(part_names_.names());
  if (is_surface) {
    WELLSPACE_RETURN_IF_ERROR(domain_.CheckOther("IN has triangles, which bound solids; give a file of segments"));
    return surface_.ReadInput(input_, cloud_options_);
  }
  WELLSPACE_RETURN_IF_ERROR(surface_.CheckOther("IN"));
  if (const char* const option = parameters_.GivenOfSurface(); option != nullptr) {
    return absl::InvalidArgumentError(absl::StrCat(
        option, ": IN has no triangles; give a .stl, .smesh or 3-D .poly, or --triangles with .obj, .ply or .off"));
  }
  if (domain_.IsDomain(input_, cloud_options_.format)) {
    return domain_.Read(input_, cloud_options_);
  }
  WELLSPACE_RETURN_IF_ERROR(domain_.CheckCloud());
  if (const char* const option = part_names_.given(); option != nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat(option, ": IN has points alone, and no markers; give a domain or a surface"));
  }
  cloud_options_.dimension = dimension();
  return formats::ReadCloud(input_, cloud_options_);
}

absl::StatusOr<client::MeshOptions> MeshingOptions::OptionsFor(const formats::PointCloud& cloud) {
  WELLSPACE_ASSIGN_OR_RETURN(client::MeshOptions options, parameters_.For(cloud.dimension, cloud.points));
  options.features = domain_.features();
  options.surface = surface_.features();
  WELLSPACE_ASSIGN_OR_RETURN(options.size_samples,
                             size_field_.Read(cloud.dimension, cloud_options_.skip_invalid, options.gradation));
  if (!options.threads.has_value()) {
    options.threads = HelpfulThreads(options, cloud.points);
  }
  return options;
}

int MeshingOptions::Run(const Work& work) {
  const absl::StatusOr<formats::PointCloud> cloud = Read();
  if (!cloud.ok()) {
    return ReportError(cloud.status(), remote_.format());
  }
  report_ = ReportOf(cloud_options_, cloud->notes, cloud->skipped);
  PrintNotes(report_, remote_.format(), remote_.quiet());
  const absl::StatusOr<client::MeshOptions> options = OptionsFor(*cloud);
  if (!options.ok()) {
    return ReportError(options.status(), remote_.format());
  }
  NoteSizes(size_field_, cloud_options_, remote_.format(), remote_.quiet(), report_);
  return remote_.Run([&](client::Client& client, const client::CallOptions& call, const Interrupt& /*interrupt*/) {
    const absl::Status status = work(client, *options, *cloud, call);
    const absl::Status explained = size_field_.WithOrigins(parameters_.Explain(status));
    if (!absl::IsInvalidArgument(status) || explained != status) {
      return explained;
    }
    return WithPlacesInFile(status, *cloud);
  });
}

absl::Status MeshingOptions::WithPlacesInFile(const absl::Status& status, const formats::PointCloud& cloud) const {
  return domain_.features() != nullptr    ? domain_.WithOrigins(status)
         : surface_.features() != nullptr ? surface_.WithOrigins(status)
                                          : WithOrigins(status, cloud);
}

absl::Status MeshingOptions::WriteStatistics(const std::string& statistics,
                                             const std::vector<std::string>& more_notes) const {
  CloudReport report = report_;
  report.notes.insert(report.notes.end(), more_notes.begin(), more_notes.end());
  const std::string json = WithNotes(report, statistics);
  if (has_figures_on_stdout()) {
    std::cout << json << std::flush;
  }
  if (statistics_.empty() || statistics_ == formats::kStandardStream) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(formats::OutputFile file, formats::OutputFile::Create(statistics_));
  file.Write(json);
  return file.Commit();
}

}  // namespace wellspace::cli
