#include "client/cli/usage.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/standard_output.h"

namespace wellspace::cli {
namespace {

// Of what could not be parsed: there is no format to ask for.
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
std::string Leftover(const CLI::App& app, const std::vector<std::string>& arguments) {
  std::vector<std::string> left = app.remaining(/*recurse=*/true);
  std::vector<std::string> in_order;
  for (const std::string& argument : arguments) {
    const auto found = std::find(left.begin(), left.end(), argument);
    if (found != left.end()) {
      left.erase(found);
      in_order.push_back(argument);
    }
  }
  return absl::StrJoin(in_order, " ");
}

absl::Status UsageError(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& arguments) {
  std::string command = app.get_name();
  const CLI::App* last = &app;
  while (!last->get_subcommands().empty()) {
    last = last->get_subcommands().front();
    absl::StrAppend(&command, " ", last->get_name());
  }
  std::string message = error.what();
  const std::string leftover = Leftover(app, arguments);
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    message = absl::StrCat("not expected: ", leftover);
  } else if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr && last->get_require_subcommand_min() > 0) {
    const std::string names = absl::StrJoin(last->get_subcommands([](const CLI::App*) { return true; }), ", ",
                                            [](std::string* out, const CLI::App* one) { *out += one->get_name(); });
    message = absl::StrCat(leftover.empty() ? "a command is missing" : absl::StrCat("there is no command ", leftover),
                           "; expected one of ", names);
  }
  return absl::InvalidArgumentError(absl::StrCat(message, "; see ", command, " --help"));
}

}  // namespace

int RunCommandLine(CLI::App& app, std::vector<std::string> arguments, const int& exit_code) {
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
  // What `check` found is lost, too. Other failures were told on standard error.
  const absl::Status written = output.Flush();
  return written.ok() || exit_code > kExitFailed ? exit_code : ReportError(written, FormatAskedFor(arguments));
}

}  // namespace wellspace::cli
