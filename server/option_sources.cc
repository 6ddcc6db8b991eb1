#include "server/option_sources.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "core/base/closest_word.h"

namespace wellspace::server {
namespace {

// The options of the unit of systemd, which come with the environment, too.
constexpr std::string_view kUnitVariable = "WELLSPACED_OPTIONS";

// --max-memory of an option, whose other names, if any, are short.
std::string NameOf(const CLI::Option& option) { return absl::StrCat("--", option.get_lnames().front()); }

// Those of `app` that have a variable.
std::vector<const CLI::Option*> OptionsWithVariables(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return !option->get_envname().empty(); });
}

bool IsOnCommandLine(const CLI::Option& option, int count, const char* const* arguments) {
  const std::string name = NameOf(option);
  for (int i = 1; i < count; ++i) {
    const std::string_view argument = arguments[i];
    if (argument.substr(0, name.size()) == name && (argument.size() == name.size() || argument[name.size()] == '=')) {
      return true;
    }
  }
  return false;
}

bool IsFromVariable(const CLI::Option& option, int count, const char* const* arguments) {
  return !ValueOf(option.get_envname()).empty() && !IsOnCommandLine(option, count, arguments);
}

std::string SourceOf(const CLI::Option& option, int count, const char* const* arguments) {
  if (IsOnCommandLine(option, count, arguments)) {
    return "command line";
  }
  if (IsFromVariable(option, count, arguments)) {
    return option.get_envname();
  }
  return option.count() > 0 ? "file" : "default";
}

// The value without the passwords of an address: that of the user, and those behind a question mark.
std::string WithoutPassword(std::string value) {
  const size_t query = value.find("://") == std::string::npos ? std::string::npos : value.find('?');
  for (size_t at = value.find("password=", query); query != std::string::npos && at != std::string::npos;
       at = value.find("password=", at + 1)) {
    const size_t begin = value.find('=', at) + 1;
    value.replace(begin, std::min(value.find('&', begin), value.size()) - begin, "***");
  }
  const size_t scheme = value.find("://");
  if (scheme == std::string::npos) {
    return value;
  }
  const size_t user = scheme + 3;
  const size_t colon = value.find(':', user);
  const size_t at = value.rfind('@');  // passwords with an @ or a slash are hidden as a whole
  if (at == std::string::npos || colon == std::string::npos || colon > at || value.find('/', user) < colon) {
    return value;
  }
  return absl::StrCat(value.substr(0, colon + 1), "***", value.substr(at));
}

// As TOML has it: numbers and flags plain, all else between quotes.
std::string InToml(const std::string& value) {
  double number = 0;
  if (value == "true" || value == "false" || absl::SimpleAtod(value, &number)) {
    return value;
  }
  return absl::StrCat("\"", absl::StrReplaceAll(value, {{"\\", "\\\\"}, {"\"", "\\\""}}), "\"");
}

}  // namespace

std::string VariableOf(std::string_view option) {
  std::string name(option.substr(option.find_first_not_of('-')));
  absl::AsciiStrToUpper(&name);
  return absl::StrCat(std::string(kVariablePrefix), absl::StrReplaceAll(name, {{"-", "_"}}));
}

std::string ValueOf(const std::string& variable) {
  const char* value = std::getenv(variable.c_str());
  return value == nullptr ? std::string() : std::string(value);
}

void DeclareVariables(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const bool has_name = !option->get_lnames().empty();
    if (has_name && (option->get_configurable() || option == app.get_config_ptr())) {
      option->envname(VariableOf(option->get_lnames().front()));
    }
  }
}

absl::Status CheckVariables(const CLI::App& app, const char* const* environment) {
  std::vector<std::string> known;  // without the prefix, which is near to everything
  for (const CLI::Option* option : OptionsWithVariables(app)) {
    known.push_back(option->get_envname().substr(kVariablePrefix.size()));
  }
  for (const char* const* entry = environment; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    const std::string name(text.substr(0, text.find('=')));
    if (name.compare(0, kVariablePrefix.size(), kVariablePrefix) != 0 || name == kUnitVariable) {
      continue;
    }
    const std::string rest = name.substr(kVariablePrefix.size());
    if (std::find(known.begin(), known.end(), rest) != known.end()) {
      continue;
    }
    const std::string meant = core::ClosestWord(rest, known);
    return absl::InvalidArgumentError(
        absl::StrCat(name, " in the environment is no option",
                     meant.empty() ? "; variables are the options, as WELLSPACED_MAX_MEMORY for --max-memory"
                                   : absl::StrCat(" (did you mean ", std::string(kVariablePrefix), meant, "?)")));
  }
  return absl::OkStatus();
}

std::string VariableBehind(const CLI::App& app, std::string_view error, int count, const char* const* arguments) {
  for (const CLI::Option* option : OptionsWithVariables(app)) {
    const std::string name = NameOf(*option);
    const size_t at = error.find(name);
    if (at == std::string_view::npos || !IsFromVariable(*option, count, arguments)) {
      continue;
    }
    const size_t end = at + name.size();
    const bool is_whole = end == error.size() || (error[end] != '-' && !absl::ascii_isalnum(error[end]));
    if (is_whole) {
      return option->get_envname();
    }
  }
  return {};
}

std::string DescribeOptions(const CLI::App& app, int count, const char* const* arguments) {
  std::string lines;
  for (const CLI::Option* option : OptionsWithVariables(app)) {
    const std::string name = option->get_lnames().front();
    const bool is_flag = option->get_items_expected_max() == 0;
    const std::string value = option->count() > 0 ? absl::StrJoin(option->results(), ",")
                              : is_flag           ? std::string("false")
                                                  : option->get_default_str();
    if (value.empty()) {
      absl::StrAppend(&lines, "# ", name, " is not set\n");
      continue;
    }
    // A file of options names no other.
    const bool is_comment = option == app.get_config_ptr();
    absl::StrAppend(&lines, is_comment ? "# " : "", name, " = ", InToml(WithoutPassword(value)), "  # ",
                    SourceOf(*option, count, arguments), "\n");
  }
  return lines;
}

}  // namespace wellspace::server
