#include "core/features/angle_order.h"

#include "core/geometry/exact_measure.h"

namespace wellspace::core {

bool AngleOrder::operator()(const Point<3>& p, const Point<3>& q) const {
  const int p_quarter = QuarterOf(p);
  const int q_quarter = QuarterOf(q);
  if (p_quarter != q_quarter) {
    return p_quarter < q_quarter;
  }
  return Orientation<3>({a_, b_, p, q}).sign == Sign::kPositive;
}

// 0: at the first half-plane; 1: up to half a turn from it; 2: half a turn; 3: beyond.
int AngleOrder::QuarterOf(const Point<3>& p) const {
  const Sign side = Orientation<3>({a_, b_, from_, p}).sign;
  if (side != Sign::kZero) {
    return side == Sign::kPositive ? 1 : 3;
  }
  // In one plane: on the same side of the line, or on the other one. Some projection shows it.
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto flat = [&](const Point<3>& x) { return Point<2>{x[(axis + 1) % 3], x[(axis + 2) % 3]}; };
    const Sign of_from = Orientation<2>({flat(a_), flat(b_), flat(from_)}).sign;
    if (of_from != Sign::kZero) {
      return Orientation<2>({flat(a_), flat(b_), flat(p)}).sign == of_from ? 0 : 2;
    }
  }
  return 0;
}

}  // namespace wellspace::core
