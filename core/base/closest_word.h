// The word that a user may have meant.
#ifndef WELLSPACE_CORE_BASE_CLOSEST_WORD_H_
#define WELLSPACE_CORE_BASE_CLOSEST_WORD_H_

#include <string>
#include <string_view>
#include <vector>

namespace wellspace::core {

// How many characters have to be put in, left out, replaced or swapped with their neighbour to make `b` of `a`; no
// character is changed twice.
size_t EditDistance(std::string_view a, std::string_view b);

// The candidate of the least distance from `word`, the first of several; or the only one that starts with `word`. Empty
// if the least distance is above 1, or above a third of the word if that is more: then it is another word.
std::string ClosestWord(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_CLOSEST_WORD_H_
