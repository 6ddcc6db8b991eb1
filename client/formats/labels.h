// Names as solvers take them. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_LABELS_H_
#define WELLSPACE_CLIENT_FORMATS_LABELS_H_

#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include "client/formats/names.h"

namespace wellspace::formats {

// Makes labels of the names of a file: letters, digits, '_', '-' and '.', a letter or '_' first, at most 80, and no two
// that differ only in the case of letters.
//
// Thread safety: thread-compatible.
class Labels {
 public:
  // The label of `name` or, where that is empty, of `kind` and `number`: "boundary_7".
  std::string Take(std::string_view name, std::string_view kind, int32_t number);

  // A note on the names whose labels are not they themselves; empty if there are none.
  std::string ChangesNote() const;

 private:
  std::set<std::string> taken_;  // in lower case
  NameChanges changes_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_LABELS_H_
