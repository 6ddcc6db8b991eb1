#include "core/estimate/domain_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/geometry/exact_measure.h"
#include "core/geometry/segment.h"

namespace wellspace::core {
namespace {

// The error of a sum, over the sum of its terms.
constexpr double kRounding = 0x1p-46;
// The error of a place on a segment, over its coordinates.
constexpr double kPlace = 0x1p-50;

}  // namespace

double DomainShape::Part::SizeFor(double max_circumradius) const {
  return std::min(max_circumradius, std::sqrt(kRadiusSqOfArea * max_area));
}

DomainShape::DomainShape(const PlanarDomain& domain) : domain_(domain) {
  const PlanarFaces& faces = domain.faces();
  box_ = BoxOfEnds(domain.EndOf(0, false), domain.EndOf(0, true));
  for (uint32_t s = 0; s < domain.segment_count(); ++s) {
    box_.Include(BoxOfEnds(domain.EndOf(s, false), domain.EndOf(s, true)));
  }
  for (int axis = 0; axis < 2; ++axis) {
    largest_ = std::max({largest_, std::abs(box_.low[axis]), std::abs(box_.high[axis])});
  }
  // Twice the area of each face, from the middle of the box.
  const Point<2> middle = {0.5 * (box_.low[0] + box_.high[0]), 0.5 * (box_.low[1] + box_.high[1])};
  std::vector<Sum> twice(faces.faces.size());
  std::vector<double> lengths(faces.faces.size(), 0.0);
  for (HalfEdge h = 0; h < 2 * domain.segment_count(); ++h) {
    const uint32_t face = faces.left_face[h];
    if (!faces.IsMeshed(face)) {
      continue;
    }
    const Edge edge{domain.EndOf(SegmentOf(h), IsFromB(h)), domain.EndOf(SegmentOf(h), !IsFromB(h))};
    const Point<2> from = Difference<2>(edge.from, middle);
    const Point<2> to = Difference<2>(edge.to, middle);
    twice[face].value += Cross(from, to);
    twice[face].size += std::abs(from[0] * to[1]) + std::abs(from[1] * to[0]);
    lengths[face] += domain.LengthOf(SegmentOf(h));
    if (!faces.IsMeshed(faces.left_face[TwinOf(h)])) {
      edges_.push_back(edge);
    }
  }
  std::map<double, Part> parts;  // by largest area
  for (size_t face = 0; face < twice.size(); ++face) {
    if (faces.faces[face].is_meshed) {
      Part& part = parts[faces.faces[face].max_area];
      part.max_area = faces.faces[face].max_area;
      part.area += std::max(0.0, 0.5 * (twice[face].value - kRounding * twice[face].size));
      part.length += lengths[face];
    }
  }
  for (const auto& [max_area, part] : parts) {
    parts_.push_back(part);
  }
  levels_.emplace_back();
  for (size_t i = 0; i < edges_.size(); ++i) {
    const Box<2> box = BoxOfEnds(edges_[i].from, edges_[i].to);
    Node& node = i % kRun == 0 ? levels_[0].emplace_back(Node{box}) : levels_[0].back();
    node.box.Include(box);
    node.along += edges_[i].to[0] - edges_[i].from[0];
    node.lengths += box.high[0] - box.low[0];
  }
  while (levels_.back().size() > 1) {
    std::vector<Node> above;
    const std::vector<Node>& below = levels_.back();
    for (size_t i = 0; i < below.size(); ++i) {
      Node& node = i % 2 == 0 ? above.emplace_back(Node{below[i].box}) : above.back();
      node.box.Include(below[i].box);
      node.along += below[i].along;
      node.lengths += below[i].lengths;
    }
    levels_.push_back(std::move(above));
  }
}

double DomainShape::area() const {
  double sum = 0;
  for (const Part& part : parts_) {
    sum += part.area;
  }
  return sum;
}

// By Green's theorem: at each place on the first axis, faces hold the part between the segments above and below it.
// Places above the box count as its upper side, and places below as the lower one.
double DomainShape::AreaIn(const Box<2>& part) const {
  Sum sum;
  if (!edges_.empty()) {
    AddBelow(levels_.size() - 1, 0, part, sum);
  }
  return std::max(0.0, sum.value - kRounding * sum.size);
}

// Adds the area of `part` below edges: where faces are below an edge, it leads backwards, and counts in full; else it
// is taken off.
void DomainShape::AddBelow(size_t level, size_t index, const Box<2>& part, Sum& sum) const {
  const Node& node = levels_[level][index];
  if (node.box.high[0] <= part.low[0] || node.box.low[0] >= part.high[0] || node.box.high[1] <= part.low[1]) {
    return;
  }
  if (node.box.low[0] >= part.low[0] && node.box.high[0] <= part.high[0] && node.box.low[1] >= part.high[1]) {
    const double height = part.high[1] - part.low[1];
    sum.value -= height * node.along;
    sum.size += height * node.lengths;
    return;
  }
  if (level == 0) {
    for (size_t i = index * kRun; i < std::min(edges_.size(), (index + 1) * kRun); ++i) {
      AddBelow(edges_[i], part, sum);
    }
    return;
  }
  for (size_t child = 2 * index; child < std::min(levels_[level - 1].size(), 2 * index + 2); ++child) {
    AddBelow(level - 1, child, part, sum);
  }
}

void DomainShape::AddBelow(const Edge& edge, const Box<2>& part, Sum& sum) const {
  const bool is_forward = edge.from[0] < edge.to[0];
  const Point<2>& left = is_forward ? edge.from : edge.to;
  const Point<2>& right = is_forward ? edge.to : edge.from;
  const double low = std::max(left[0], part.low[0]);
  const double high = std::min(right[0], part.high[0]);
  if (!(low < high)) {
    return;
  }
  const auto height_at = [&](double x) {
    return left[1] + (right[1] - left[1]) * ((x - left[0]) / (right[0] - left[0])) - part.low[1];
  };
  const double most = part.high[1] - part.low[1];
  const double first = height_at(low);
  const double last = height_at(high);
  // Where it comes into the box and leaves it, as parts of the way from `low` to `high`.
  std::array<double, 4> cuts = {0, 1, 0, 0};
  if (first != last) {
    cuts[2] = std::clamp((0 - first) / (last - first), 0.0, 1.0);
    cuts[3] = std::clamp((most - first) / (last - first), 0.0, 1.0);
  }
  std::sort(cuts.begin(), cuts.end());
  double area = 0;
  for (size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double from = std::clamp(std::lerp(first, last, cuts[i]), 0.0, most);
    const double to = std::clamp(std::lerp(first, last, cuts[i + 1]), 0.0, most);
    area += 0.5 * (from + to) * (cuts[i + 1] - cuts[i]) * (high - low);
  }
  sum.value += is_forward ? -area : area;
  sum.size += area + (high - low) * largest_ * (kPlace / kRounding);
}

bool DomainShape::Meets(const Box<2>& part) const {
  return AreaIn(part) > 0 || Contains({0.5 * (part.low[0] + part.high[0]), 0.5 * (part.low[1] + part.high[1])});
}

// Whether a face holds `p`, which is on no segment: by the edges above it.
bool DomainShape::Contains(const Point<2>& p) const {
  int above = 0;
  for (const auto& [from, to] : edges_) {
    if ((from[0] <= p[0]) == (to[0] <= p[0])) {
      continue;
    }
    const Sign side = Orientation<2>({from, to, p}).sign;
    if (side == Sign::kZero) {
      return true;
    }
    // Faces are on the left: of an edge above `p` that leads backwards they are below.
    const bool is_forward = from[0] <= p[0];
    if (side == (is_forward ? Sign::kNegative : Sign::kPositive)) {
      above += is_forward ? -1 : 1;
    }
  }
  return above > 0;
}

double DomainShape::LeastVertices(double max_circumradius) const {
  const PlanarFaces& faces = domain_.faces();
  double vertices = domain_.point_count();
  for (uint32_t s = 0; s < domain_.segment_count(); ++s) {
    double size = max_circumradius;
    for (const bool from_b : {false, true}) {
      const Face& face = faces.faces[faces.left_face[HalfEdgeOf(s, from_b)]];
      size = face.is_meshed ? std::min(size, std::sqrt(kRadiusSqOfArea * face.max_area)) : size;
    }
    vertices += std::max(0.0, domain_.LengthOf(s) / (2 * size) - 1);
  }
  return vertices;
}

}  // namespace wellspace::core
