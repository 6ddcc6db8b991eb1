// The O(1) claims of the query structure, by counters and not by the clock.
#ifndef WELLSPACE_TESTS_CORE_GROWTH_H_
#define WELLSPACE_TESTS_CORE_GROWTH_H_

#include <span>
#include <string_view>

namespace wellspace::test {

// Meshes clouds of `kind` of the given sizes, ascending, and expects that the counts per query and the queries per
// vertex of the later ones stay within constant factors of the first one's.
void ExpectConstantWork(std::string_view kind, int dimension, std::span<const size_t> sizes);

// The same of domains of about so many segments: "random", segments in a box, each in a cell of a grid; "coast", Koch's
// snowflake; "hole", a ring of a regular polygon in a box, whose inside is not meshed.
void ExpectConstantWorkInDomains(std::string_view kind, std::span<const size_t> sizes);

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_CORE_GROWTH_H_
