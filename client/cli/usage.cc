#include "client/cli/usage.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/command_tree.h"
#include "client/cli/domain_options.h"
#include "client/cli/length.h"
#include "client/cli/standard_output.h"
#include "core/base/closest_word.h"

namespace wellspace::cli {
namespace {

// Of a command line that could not be parsed: there is no format to ask for.
OutputFormat FormatAskedFor(const std::vector<std::string>& arguments) {
  for (size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--output=json" ||
        (arguments[i] == "--output" && i + 1 < arguments.size() && arguments[i + 1] == "json")) {
      return OutputFormat::kJson;
    }
  }
  return OutputFormat::kText;
}

// The words that nothing has taken, as they were written.
std::vector<std::string> Leftover(const CLI::App& app, const std::vector<std::string>& arguments) {
  std::vector<std::string> left = app.remaining(/*recurse=*/true);
  std::vector<std::string> in_order;
  for (const std::string& argument : arguments) {
    const auto found = std::find(left.begin(), left.end(), argument);
    if (found != left.end()) {
      left.erase(found);
      in_order.push_back(argument);
    }
  }
  return in_order;
}

// " (did you mean mesh?)"; empty if nothing is near.
std::string Suggestion(const std::string& meant) {
  return meant.empty() ? std::string() : absl::StrCat(" (did you mean ", meant, "?)");
}

bool IsOption(const std::string& word) { return word.size() > 1 && word[0] == '-'; }

// The option of `command` that `word` may stand for.
std::string MeantOption(const CLI::App& command, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::Option* option : Command{.name = "", .app = &command}.Options()) {
    const std::vector<std::string> more = NamesOf(*option);
    names.insert(names.end(), more.begin(), more.end());
  }
  const std::string name = word.substr(0, word.find('='));
  return name.size() > 2 ? core::ClosestWord(name, names) : std::string();  // any two letters are near each other
}

// The command among `below` that `word` may stand for, or one of another place that has this name.
std::string MeantCommand(const CLI::App& app, const std::vector<std::string>& below, const std::string& word) {
  std::string meant = core::ClosestWord(word, below);
  for (const Command& command : TreeOf(app)) {
    if (meant.empty() && command.name.ends_with(" " + word)) {
      meant = command.name;
    }
  }
  return meant;
}

absl::Status UsageError(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& arguments) {
  std::string command = app.get_name();
  const CLI::App* last = &app;
  while (!last->get_subcommands().empty()) {
    last = last->get_subcommands().front();
    absl::StrAppend(&command, " ", last->get_name());
  }
  std::string message = error.what();
  const std::vector<std::string> leftover = Leftover(app, arguments);
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    const auto option = std::find_if(leftover.begin(), leftover.end(), IsOption);
    message = absl::StrCat("not expected: ", absl::StrJoin(leftover, " "),
                           Suggestion(option == leftover.end() ? "" : MeantOption(*last, *option)));
  } else if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr && last->get_require_subcommand_min() > 0) {
    std::vector<std::string> names;
    for (const CLI::App* one : last->get_subcommands([](const CLI::App*) { return true; })) {
      names.push_back(one->get_name());
    }
    if (leftover.empty()) {
      message = "a command is missing";
    } else if (const std::string& word = leftover.front(); IsOption(word)) {
      message = absl::StrCat("not expected: ", word, Suggestion(MeantOption(*last, word)), "; a command is missing");
    } else {
      message = absl::StrCat("there is no command ", word, Suggestion(MeantCommand(app, names, word)));
    }
    absl::StrAppend(&message, "; expected one of ", absl::StrJoin(names, ", "));
  }
  return absl::InvalidArgumentError(absl::StrCat(message, "; see ", command, " --help"));
}

}  // namespace

int RunCommandLine(CLI::App& app, std::vector<std::string> arguments, const int& exit_code) {
  for (size_t i = 0; i < arguments.size(); ++i) {
    const bool has_value = i + 1 < arguments.size() && IsLengthOrNone(arguments[i + 1]);
    if (arguments[i] == kSnapOption && !has_value) {
      arguments[i] = absl::StrCat(kSnapOption, "=0");
    }
  }
  StandardOutput output;
  try {
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
    app.parse(std::move(reversed));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) {
      return ReportError(UsageError(app, error, arguments), FormatAskedFor(arguments));
    }
    app.exit(error);  // --help, --version
  }
  // The findings of `check` are lost, too. Other failures were told on standard error.
  const absl::Status written = output.Flush();
  return written.ok() || exit_code > kExitFailed ? exit_code : ReportError(written, FormatAskedFor(arguments));
}

}  // namespace wellspace::cli
