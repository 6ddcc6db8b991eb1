#include "client/cli/help_pages.h"

#include <map>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "client/cli/command_tree.h"
#include "client/cli/exit_codes.h"

namespace wellspace::cli {
namespace {

// Text for troff.
std::string Escaped(const std::string& text) {
  std::string escaped =
      absl::StrReplaceAll(text, {{"\\", "\\e"}, {"-", "\\-"}, {"'", "\\(aq"}, {"\"", "\\(dq"}, {"\u00b7", "\\(pc"}});
  if (!escaped.empty() && escaped[0] == '.') {
    escaped.insert(0, "\\&");
  }
  return escaped;
}

// Lines as they are.
std::string Verbatim(const std::string& text) {
  std::string lines = ".nf\n";
  for (const auto& line : absl::StrSplit(absl::StripTrailingAsciiWhitespace(text), '\n')) {
    absl::StrAppend(&lines, Escaped(std::string(line)), "\n");
  }
  return lines + ".fi\n";
}

// Choices may go on in the next line.
std::string Breakable(const std::string& choices) { return absl::StrReplaceAll(choices, {{"|", "|\\:"}}); }

std::string OptionEntry(const CLI::Option& option) {
  std::string entry = ".TP\n";
  if (IsPositional(option)) {
    absl::StrAppend(&entry, "\\fI", Escaped(option.get_name(true)), "\\fR\n");
  } else {
    std::vector<std::string> names;
    for (const std::string& name : NamesOf(option)) {
      names.push_back(absl::StrCat("\\fB", Escaped(name), "\\fR"));
    }
    absl::StrAppend(&entry, absl::StrJoin(names, ", "),
                    TakesValue(option) ? absl::StrCat(" \\fI", Breakable(Escaped(ValueOf(option))), "\\fR") : "", "\n");
  }
  absl::StrAppend(&entry, Escaped(option.get_description()));
  if (!option.get_envname().empty()) {
    absl::StrAppend(&entry, "; or the environment\\(aqs ", Escaped(option.get_envname()));
  }
  return entry + "\n";
}

std::string Section(const Command& command) {
  std::string synopsis = absl::StrCat("wellspace ", command.name);
  std::string positionals;
  std::string options;
  for (const CLI::Option* option : command.Options()) {
    (IsPositional(*option) ? positionals : options) += OptionEntry(*option);
    if (IsPositional(*option)) {
      const bool many = option->get_items_expected_max() > 1;
      const std::string name = absl::StrCat(option->get_name(true), many ? "..." : "");
      absl::StrAppend(&synopsis, " ", option->get_required() ? name : absl::StrCat("[", name, "]"));
    }
  }
  // The exit codes have a section of their own.
  const std::string footer = absl::StrReplaceAll(command.app->get_footer(), {{kExitCodesHelp, ""}});
  return absl::StrCat(".SS \"", Escaped(synopsis), " [options]\"\n", Escaped(command.app->get_description()), ".\n",
                      positionals, options,
                      absl::StripAsciiWhitespace(footer).empty() ? "" : absl::StrCat(".PP\n", Verbatim(footer)));
}

}  // namespace

std::string ManualPage(const CLI::App& app, const std::string& version) {
  std::string commands;
  std::map<std::string, std::string> environment;
  for (const Command& command : TreeOf(app)) {
    for (const CLI::Option* option : command.Options()) {
      if (!option->get_envname().empty()) {
        environment[option->get_envname()] = option->get_lnames().front();
      }
    }
    if (!command.name.empty() && command.Subcommands().empty()) {
      commands += Section(command);
    }
  }
  std::string variables;
  for (const auto& [name, option] : environment) {
    absl::StrAppend(&variables, ".TP\n\\fB", Escaped(name), "\\fR\nThe default of \\fB\\-\\-", Escaped(option),
                    "\\fR.\n");
  }
  return absl::StrCat(
      ".TH WELLSPACE 1 \"\" \"wellspace ", Escaped(version), "\" \"User Commands\"\n.SH NAME\nwellspace \\- ",
      Escaped(absl::AsciiStrToLower(app.get_description().substr(0, 1)) + app.get_description().substr(1)),
      "\n.SH SYNOPSIS\n\\fBwellspace\\fR \\fIcommand\\fR [\\fIoptions\\fR]\n.SH DESCRIPTION\n"
      "A point cloud becomes a mesh in one call of \\fBmesh\\fR, in this process or on a server. On a server a session "
      "keeps points "
      "and mesh between calls: \\fBsession create\\fR, \\fBupload\\fR, \\fBrefine\\fR, \\fBdownload\\fR; then "
      "\\fBadd\\fR or "
      "\\fBupload\\fR more points, and \\fBrefine\\fR again, at the cost of what is new.\n.PP\n"
      "Results go to standard output, progress and errors to standard error. With \\fB\\-\\-output json\\fR results "
      "are JSON, and "
      "errors a JSON object in one line. Files named \\fB\\-\\fR are standard input or output. Ctrl\\-C cancels the "
      "work of "
      "\\fBmesh\\fR, \\fBestimate\\fR and \\fBrefine\\fR, and ends the others.\n.SH COMMANDS\n",
      commands, ".SH EXIT STATUS\n", Verbatim(kExitCodesHelp), ".SH ENVIRONMENT\n", variables,
      ".SH SEE ALSO\n\\fBwellspaced\\fR(8)\n");
}

}  // namespace wellspace::cli
