#include "core/partition/partition.h"

#include <metis.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/partition/facets_of.h"

namespace wellspace::core {
namespace {

static_assert(sizeof(idx_t) == sizeof(int32_t));

// The memory of METIS, as measured, for each simplex and each entry of its neighbours, and that of any graph.
constexpr uint64_t kMetisBytesPerSimplex = 120;
constexpr uint64_t kMetisBytesPerNeighbour = 24;
constexpr uint64_t kMetisBytes = uint64_t{1} << 22;

constexpr uint64_t kMaxSimplices = std::numeric_limits<int32_t>::max();

// How long a process that partitions is left alone between two looks at the context.
constexpr int kPollMilliseconds = 20;

// The memory of a partition beside this graph of so many simplices and entries of their neighbours: METIS, and the
// parts twice.
uint64_t BytesOf(uint64_t simplices, uint64_t neighbours) {
  return kMetisBytes + simplices * (kMetisBytesPerSimplex + 2 * sizeof(uint32_t)) +
         neighbours * kMetisBytesPerNeighbour;
}

// Memory that a process has in common with the processes that it makes.
class SharedParts {
 public:
  explicit SharedParts(uint64_t count)
      : bytes_(count * sizeof(idx_t)),
        memory_(mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {}
  SharedParts(const SharedParts&) = delete;
  SharedParts& operator=(const SharedParts&) = delete;
  ~SharedParts() {
    if (is_there()) {
      munmap(memory_, bytes_);
    }
  }

  bool is_there() const { return memory_ != MAP_FAILED; }
  idx_t* data() const { return static_cast<idx_t*>(memory_); }

 private:
  uint64_t bytes_;
  void* memory_;
};

// Runs METIS. The arrays are not written to, although its functions take pointers that are not to const.
int CutByMetis(const DualGraph& graph, const PartitionOptions& options, idx_t* part_of) {
  idx_t metis_options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(metis_options);
  metis_options[METIS_OPTION_SEED] = 1;
  metis_options[METIS_OPTION_NUMBERING] = 0;
  metis_options[METIS_OPTION_UFACTOR] = static_cast<idx_t>(std::lround(kMostImbalance * 1000));
  metis_options[METIS_OPTION_CONTIG] = options.contiguous ? 1 : 0;
  idx_t vertices = static_cast<idx_t>(graph.simplex_count());
  idx_t constraints = 1;
  idx_t parts = static_cast<idx_t>(options.parts);
  idx_t cut = 0;
  return METIS_PartGraphKway(&vertices, &constraints, const_cast<idx_t*>(graph.first.data()),
                             const_cast<idx_t*>(graph.neighbours.data()), nullptr, nullptr, nullptr, &parts, nullptr,
                             nullptr, metis_options, &cut, part_of);
}

// Waits until the process has ended, or kills it when the run is cancelled. Where signals of ended processes are
// ignored, as some parents have it, nothing is known of how it has ended.
absl::Status WaitFor(pid_t process, const RunContext& context) {
  absl::Status status;
  for (;;) {
    const pid_t ended = waitpid(process, nullptr, status.ok() ? WNOHANG : 0);
    if (ended == process || (ended < 0 && errno != EINTR)) {
      break;
    }
    if (status.ok()) {
      status = context.Check();
      if (!status.ok()) {
        kill(process, SIGKILL);
        continue;
      }
      poll(nullptr, 0, kPollMilliseconds);
    }
  }
  return status;
}

// METIS in a process of its own. `part_of` has a number more than there are simplices, and it is 0: the process writes
// 1 there once all is well.
absl::Status CutApart(const DualGraph& graph, const PartitionOptions& options, const RunContext& context,
                      idx_t* part_of) {
  volatile idx_t& is_done = part_of[graph.simplex_count()];
  const pid_t process = fork();
  if (process < 0) {
    return absl::ResourceExhaustedError(absl::StrCat("no process for a partition: ", std::strerror(errno)));
  }
  if (process == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // it does not outlive this process
    // METIS writes its complaints to standard output and error. The others are connections and files of a server, which
    // may want to close them meanwhile.
    close_range(STDOUT_FILENO, ~0U, 0);
    is_done = CutByMetis(graph, options, part_of) == METIS_OK ? 1 : 0;
    _exit(0);
  }
  WELLSPACE_RETURN_IF_ERROR(WaitFor(process, context));
  return is_done == 1 ? absl::OkStatus()
                      : absl::ResourceExhaustedError(absl::StrCat("METIS could not cut ", graph.simplex_count(),
                                                                  " simplices into ", options.parts,
                                                                  " parts; most likely it was out of memory"));
}

// The sizes that parts are to have, of which the largest or the smallest is found at once. There may be a million.
class WantedSizes {
 public:
  explicit WantedSizes(const std::vector<uint64_t>& sizes) : sizes_(sizes) {
    for (uint32_t part = 0; part < sizes.size(); ++part) {
      by_size_.emplace(sizes[part], part);
    }
  }

  uint64_t operator[](uint32_t part) const { return sizes_[part]; }
  // Of as many parts as have that size, the one with the lowest number.
  uint32_t Smallest() const { return by_size_.begin()->second; }
  uint32_t Largest() const { return by_size_.lower_bound({by_size_.rbegin()->first, 0})->second; }
  // One simplex goes from `from` to `to`.
  void Move(uint32_t from, uint32_t to) {
    Set(from, sizes_[from] - 1);
    Set(to, sizes_[to] + 1);
  }

 private:
  void Set(uint32_t part, uint64_t size) {
    by_size_.erase({sizes_[part], part});
    sizes_[part] = size;
    by_size_.emplace(size, part);
  }

  std::vector<uint64_t> sizes_;
  std::set<std::pair<uint64_t, uint32_t>> by_size_;
};

// Gives simplices of the largest parts to those that are empty and, of those that have more than `most`, to the
// smallest: the last ones in the order of their numbers.
//
// Complexity: O(m), and O(log parts) for each simplex that is given.
absl::Status EvenOut(uint32_t parts, uint64_t most, const RunContext& context, HugeVector<uint32_t>& part_of) {
  std::vector<uint64_t> sizes(parts, 0);
  for (const uint32_t part : part_of) {
    ++sizes[part];
  }
  if (std::all_of(sizes.begin(), sizes.end(), [most](uint64_t size) { return size > 0 && size <= most; })) {
    return absl::OkStatus();
  }
  WantedSizes wanted(sizes);
  std::vector<uint32_t> short_of;  // of a simplex each
  const auto give = [&](uint32_t from, uint32_t to) {
    wanted.Move(from, to);
    short_of.push_back(to);
    return CheckAt(short_of.size(), context);
  };
  for (uint32_t part = 0; part < parts; ++part) {
    if (sizes[part] == 0) {
      WELLSPACE_RETURN_IF_ERROR(give(wanted.Largest(), part));
    }
  }
  for (uint32_t part = 0; part < parts; ++part) {
    while (wanted[part] > most) {
      WELLSPACE_RETURN_IF_ERROR(give(part, wanted.Smallest()));
    }
  }
  for (uint64_t s = part_of.size(); s-- > 0 && !short_of.empty();) {
    uint64_t& size = sizes[part_of[s]];
    if (size > wanted[part_of[s]]) {
      --size;
      part_of[s] = short_of.back();
      short_of.pop_back();
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<DualGraph> FindDualGraph(int dimension, std::span<const uint32_t> simplices, const RunContext& context) {
  const size_t corners = dimension + 1;
  const uint64_t count = simplices.size() / corners;
  if (count * corners > kMaxSimplices) {
    return absl::InvalidArgumentError(
        absl::StrCat("a partition of ", count, " simplices, of which there may be ", kMaxSimplices / corners));
  }
  WELLSPACE_RETURN_IF_ERROR(context.ReserveMemory(DualGraphBytes(dimension, count)));
  const uint64_t vertices = simplices.empty() ? 0 : uint64_t{*std::max_element(simplices.begin(), simplices.end())} + 1;
  DualGraph graph;
  graph.first.assign(count + 1, 0);
  // Pairs of neighbours; each is found once.
  HugeVector<std::pair<int32_t, int32_t>> pairs;
  WELLSPACE_RETURN_IF_ERROR(ForFacetsOfEachVertex(
      {dimension, simplices, {}}, vertices, context, [&](std::span<const FacetOfRow> facets) -> absl::Status {
        for (size_t i = 0; i + 1 < facets.size(); ++i) {
          if (facets[i].vertices != facets[i + 1].vertices) {
            continue;
          }
          if (i + 2 < facets.size() && facets[i].vertices == facets[i + 2].vertices) {
            return absl::InvalidArgumentError(absl::StrCat("simplices ", facets[i].row, ", ", facets[i + 1].row,
                                                           " and ", facets[i + 2].row, " have a facet in common"));
          }
          pairs.emplace_back(facets[i].row, facets[i + 1].row);
          ++graph.first[facets[i].row + 1];
          ++graph.first[facets[i + 1].row + 1];
        }
        return absl::OkStatus();
      }));
  for (uint64_t s = 0; s < count; ++s) {
    graph.first[s + 1] += graph.first[s];
  }
  graph.neighbours.resize(2 * pairs.size());
  HugeVector<int32_t> next(graph.first.begin(), graph.first.end());
  for (size_t i = 0; i < pairs.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    const auto& [a, b] = pairs[i];
    graph.neighbours[next[a]++] = b;
    graph.neighbours[next[b]++] = a;
  }
  for (uint64_t s = 0; s < count; ++s) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(s, context));
    std::sort(graph.neighbours.begin() + graph.first[s], graph.neighbours.begin() + graph.first[s + 1]);
  }
  return graph;
}

absl::StatusOr<HugeVector<uint32_t>> Partition(const DualGraph& graph, const PartitionOptions& options,
                                               const RunContext& context) {
  const uint64_t count = graph.simplex_count();
  if (options.parts == 0 || options.parts > kMaxParts) {
    return absl::InvalidArgumentError(absl::StrCat("parts: ", options.parts, " is not a number from 1 to ", kMaxParts));
  }
  if (options.parts > count) {
    return absl::InvalidArgumentError(absl::StrCat("parts: ", options.parts, " parts of a mesh of ", count,
                                                   " simplices; each part has at least one"));
  }
  WELLSPACE_RETURN_IF_ERROR(context.ReserveMemory(BytesOf(count, graph.neighbours.size())));
  HugeVector<uint32_t> part_of(count, 0);
  if (options.parts == 1) {
    return part_of;
  }
  const SharedParts shared(count + 1);
  if (!shared.is_there()) {
    return absl::ResourceExhaustedError(absl::StrCat("no memory for the parts of ", count, " simplices"));
  }
  WELLSPACE_RETURN_IF_ERROR(CutApart(graph, options, context, shared.data()));
  std::copy_n(shared.data(), count, part_of.begin());
  const uint64_t mean = (count + options.parts - 1) / options.parts;
  const auto allowed =
      static_cast<uint64_t>((1 + kMostImbalance) * static_cast<double>(count) / static_cast<double>(options.parts));
  const uint64_t most = options.contiguous ? count : std::max(allowed, mean + 1);
  WELLSPACE_RETURN_IF_ERROR(EvenOut(options.parts, most, context, part_of));
  return part_of;
}

uint64_t DualGraphBytes(int dimension, uint64_t simplices) {
  const uint64_t facets = simplices * (dimension + 1);
  // The facets by vertices, of which there are no more than corners; pairs, the graph, and a copy of where lists begin.
  return FacetsOfEachVertexBytes(facets, facets) + 8 * facets + 4 * facets + 8 * simplices;
}

uint64_t PartitionBytes(int dimension, uint64_t simplices) { return BytesOf(simplices, simplices * (dimension + 1)); }

uint64_t CountCut(const DualGraph& graph, std::span<const uint32_t> part_of) {
  uint64_t cut = 0;
  for (uint64_t s = 0; s < graph.simplex_count(); ++s) {
    for (int32_t i = graph.first[s]; i < graph.first[s + 1]; ++i) {
      const auto other = static_cast<uint64_t>(graph.neighbours[i]);
      cut += s < other && part_of[s] != part_of[other] ? 1 : 0;
    }
  }
  return cut;
}

}  // namespace wellspace::core
