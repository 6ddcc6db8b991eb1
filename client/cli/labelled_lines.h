// Lines of text, each of a label and a value.
#ifndef WELLSPACE_CLIENT_CLI_LABELLED_LINES_H_
#define WELLSPACE_CLIENT_CLI_LABELLED_LINES_H_

#include <iostream>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/json/json.h"

namespace wellspace::cli {

// Prints a line on standard output.
inline void PrintLine(const std::string& label, const std::string& text) {
  std::cout << absl::StrFormat("%-20s %s\n", label, text);
}

// "0, 0.5, 1"
inline std::string Numbers(const client::Json& numbers) {
  std::string text;
  for (const client::Json& number : numbers) {
    absl::StrAppend(&text, text.empty() ? "" : ", ", absl::StrFormat("%.9g", number.get<double>()));
  }
  return text;
}

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_LABELLED_LINES_H_
