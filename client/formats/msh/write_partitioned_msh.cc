// Gmsh's MSH 4.1 of a mesh and its partition.
#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/io/output_file.h"
#include "client/formats/msh/msh.h"
#include "client/formats/msh/msh_groups.h"
#include "client/formats/write_parts.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr uint64_t kBlockBytes = uint64_t{1} << 16;

// An entity of a group in a part.
struct PartitionedEntity {
  int32_t number = 0;
  int32_t parent = 0;  // the entity of the whole group
  int32_t group = 0;
  int32_t part = 0;              // from 1 on
  std::vector<uint64_t> rows{};  // simplices, or facets
};

class PartitionedMshWriter {
 public:
  PartitionedMshWriter(OutputFile output, const MeshView& mesh, const PartitionView& partition)
      : mesh_(mesh), partition_(partition), shape_(mesh.Shape()), groups_(shape_), output_(std::move(output)) {
    // So that entities are described whatever is told of the mesh.
    if (shape_.regions.empty()) {
      shape_.regions = groups_.regions();
    }
    FindSimplexEntities();
    FindFacetEntities();
  }

  absl::Status Write(std::vector<std::string>* notes) {
    std::string text = "$MeshFormat\n4.1 1 8\n";
    AppendBytes<int32_t>(1, text);
    absl::StrAppend(&text, "\n$EndMeshFormat\n", groups_.PhysicalNames());
    groups_.AppendEntities(text);
    AppendPartitionedEntities(text);
    Send(text, 0);
    WriteNodes();
    WriteElements();
    WriteGhosts();
    if (notes != nullptr) {
      for (std::string& note : groups_.Notes()) {
        if (!note.empty()) {
          notes->push_back(std::move(note));
        }
      }
    }
    return output_.Commit();
  }

 private:
  int dimension() const { return mesh_.dimension; }

  // The entity of a group in a part, which is made when it is first asked for.
  static std::vector<uint64_t>& RowsOf(std::map<std::pair<int32_t, int32_t>, PartitionedEntity>& entities,
                                       int32_t parent, int32_t group, uint32_t part) {
    PartitionedEntity& entity = entities[{parent, static_cast<int32_t>(part)}];
    entity.parent = parent;
    entity.group = group;
    entity.part = static_cast<int32_t>(part) + 1;
    return entity.rows;
  }

  // Numbers behind those of whole groups.
  static void Number(const std::map<int32_t, int32_t>& parents,
                     std::map<std::pair<int32_t, int32_t>, PartitionedEntity>& entities, int32_t& next) {
    for (const auto& [group, parent] : parents) {
      next = std::max(next, parent + 1);
    }
    for (auto& [key, entity] : entities) {
      entity.number = next++;
    }
  }

  void FindSimplexEntities() {
    for (uint64_t s = 0; s < mesh_.simplex_count(); ++s) {
      const int32_t group = mesh_.simplex_regions.empty() ? groups_.first() : mesh_.simplex_regions[s];
      RowsOf(simplex_entities_, groups_.entities().at(group), group, partition_.part_of[s]).push_back(s);
    }
    Number(groups_.entities(), simplex_entities_, next_simplex_entity_);
  }

  void FindFacetEntities() {
    PartWalk walk(mesh_.boundary);
    const uint64_t facets = CountFacets(mesh_.boundary);
    for (uint64_t f = 0; f < facets; ++f) {
      const int32_t tag = walk.Next().tag;
      RowsOf(facet_entities_, groups_.part_entities().at(tag), tag, partition_.facet_owners[f]).push_back(f);
    }
    int32_t next = 1;
    Number(groups_.part_entities(), facet_entities_, next);
  }

  // Behind the numbers of the entities of simplices: those of the ghosts of each part.
  int32_t GhostEntityOf(uint32_t part) const { return next_simplex_entity_ + static_cast<int32_t>(part); }

  void AppendPartitionedEntities(std::string& text) const {
    text += "$PartitionedEntities\n";
    AppendBytes<uint64_t>(partition_.parts, text);
    AppendBytes<uint64_t>(partition_.parts, text);
    for (uint32_t part = 0; part < partition_.parts; ++part) {
      AppendBytes(GhostEntityOf(part), text);
      AppendBytes(static_cast<int32_t>(part) + 1, text);
    }
    for (int of = 0; of <= 3; ++of) {
      AppendBytes<uint64_t>(of == dimension()       ? simplex_entities_.size()
                            : of == dimension() - 1 ? facet_entities_.size()
                                                    : 0,
                            text);
    }
    for (const auto* entities : {&facet_entities_, &simplex_entities_}) {
      for (const auto& [key, entity] : *entities) {
        AppendBytes(entity.number, text);
        AppendBytes<int32_t>(entities == &simplex_entities_ ? dimension() : dimension() - 1, text);
        AppendBytes(entity.parent, text);
        AppendBytes<uint64_t>(1, text);
        AppendBytes(entity.part, text);
        groups_.AppendBoxAndGroup(entity.group, text);
        AppendBytes<uint64_t>(0, text);
      }
    }
    text += "\n$EndPartitionedEntities\n";
  }

  // All nodes are of one entity: which parts have them follows from elements.
  void WriteNodes() {
    std::string text = "$Nodes\n";
    const uint64_t count = mesh_.vertex_count();
    for (const uint64_t value : {uint64_t{count > 0 ? 1u : 0u}, count, uint64_t{count > 0 ? 1u : 0u}, count}) {
      AppendBytes(value, text);
    }
    if (count > 0) {
      const int32_t entity =
          simplex_entities_.empty() ? groups_.entities().begin()->second : simplex_entities_.begin()->second.number;
      for (const int32_t value : {static_cast<int32_t>(dimension()), entity, 0}) {
        AppendBytes(value, text);
      }
      AppendBytes(count, text);
    }
    for (uint64_t v = 0; v < count; ++v) {
      AppendBytes(v + 1, text);
      Send(text, kBlockBytes);
    }
    for (uint64_t v = 0; v < count; ++v) {
      for (int axis = 0; axis < 3; ++axis) {
        AppendBytes(axis < dimension() ? mesh_.points[v * dimension() + axis] : 0.0, text);
      }
      Send(text, kBlockBytes);
    }
    text += "\n$EndNodes\n";
    Send(text, 0);
  }

  // Simplices are numbered as the mesh has them, from 1 on; facets behind them.
  void WriteElements() {
    std::string text = "$Elements\n";
    const uint64_t facets = CountFacets(mesh_.boundary);
    const uint64_t count = mesh_.simplex_count() + facets;
    for (const uint64_t value :
         {simplex_entities_.size() + facet_entities_.size(), count, uint64_t{count > 0 ? 1u : 0u}, count}) {
      AppendBytes<uint64_t>(value, text);
    }
    WriteBlocks(simplex_entities_, mesh_.simplices, dimension(), 0, text);
    WriteBlocks(facet_entities_, mesh_.facets, dimension() - 1, mesh_.simplex_count(), text);
    text += "\n$EndElements\n";
    Send(text, 0);
  }

  void WriteBlocks(const std::map<std::pair<int32_t, int32_t>, PartitionedEntity>& entities,
                   std::span<const uint32_t> rows, int of, uint64_t before, std::string& text) {
    const int32_t type = of == 1 ? kMshLine : of == 2 ? kMshTriangle : kMshTetrahedron;
    for (const auto& [key, entity] : entities) {
      for (const int32_t value : {static_cast<int32_t>(of), entity.number, type}) {
        AppendBytes(value, text);
      }
      AppendBytes<uint64_t>(entity.rows.size(), text);
      for (const uint64_t row : entity.rows) {
        AppendBytes<uint64_t>(before + row + 1, text);
        for (const uint32_t corner : rows.subspan(row * (of + 1), of + 1)) {
          AppendBytes<uint64_t>(uint64_t{corner} + 1, text);
        }
        Send(text, kBlockBytes);
      }
    }
  }

  // Of each simplex the part that owns it, and those of which it is a ghost.
  void WriteGhosts() {
    std::vector<std::pair<uint32_t, uint32_t>> ghosts;  // simplex, part
    for (uint32_t part = 0; part < partition_.parts; ++part) {
      for (uint64_t i = partition_.first_ghost[part]; i < partition_.first_ghost[part + 1]; ++i) {
        ghosts.emplace_back(partition_.ghosts[i], part);
      }
    }
    std::sort(ghosts.begin(), ghosts.end());
    uint64_t count = 0;
    for (size_t i = 0; i < ghosts.size(); ++i) {
      count += i == 0 || ghosts[i].first != ghosts[i - 1].first ? 1 : 0;
    }
    std::string text = "$GhostElements\n";
    AppendBytes(count, text);
    for (size_t begin = 0; begin < ghosts.size();) {
      size_t end = begin;
      while (end < ghosts.size() && ghosts[end].first == ghosts[begin].first) {
        ++end;
      }
      AppendBytes<uint64_t>(uint64_t{ghosts[begin].first} + 1, text);
      AppendBytes(static_cast<int32_t>(partition_.part_of[ghosts[begin].first]) + 1, text);
      AppendBytes<uint64_t>(end - begin, text);
      for (; begin < end; ++begin) {
        AppendBytes(static_cast<int32_t>(ghosts[begin].second) + 1, text);
      }
      Send(text, kBlockBytes);
    }
    text += "\n$EndGhostElements\n";
    Send(text, 0);
  }

  // Writes the gathered rows, if they are so many bytes.
  void Send(std::string& text, uint64_t least) {
    if (text.size() >= least) {
      output_.Write(text);
      text.clear();
    }
  }

  const MeshView& mesh_;
  const PartitionView& partition_;
  MeshShape shape_;
  MshGroups groups_;
  OutputFile output_;
  // By the entity of the whole group, and by part.
  std::map<std::pair<int32_t, int32_t>, PartitionedEntity> simplex_entities_;
  std::map<std::pair<int32_t, int32_t>, PartitionedEntity> facet_entities_;
  int32_t next_simplex_entity_ = 1;
};

}  // namespace

absl::Status WritePartitionedMsh(const std::string& path, const MeshView& mesh, const PartitionView& partition,
                                 std::stop_token stop, std::vector<std::string>* notes) {
  constexpr uint64_t kMaxVertices = std::numeric_limits<int32_t>::max();
  if (mesh.dimension != 2 && mesh.dimension != 3) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path,
                                                   ": MSH holds meshes in 2-D and 3-D, and this one is ",
                                                   mesh.dimension, "-D; expected npz"));
  }
  if (mesh.vertex_count() > kMaxVertices) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": MSH numbers at most ", kMaxVertices,
                                                   " vertices, and this mesh has ", mesh.vertex_count(),
                                                   "; expected vtu or npz"));
  }
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  return PartitionedMshWriter(std::move(output), mesh, partition).Write(notes);
}

}  // namespace wellspace::formats
