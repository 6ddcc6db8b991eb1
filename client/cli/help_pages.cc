#include "client/cli/help_pages.h"

#include <map>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "client/cli/exit_codes.h"

namespace wellspace::cli {
namespace {

struct Command {
  std::string name;  // without that of the tool: "session create"; empty: the tool itself
  const CLI::App* app;

  std::vector<const CLI::App*> Subcommands() const {
    return app->get_subcommands([](const CLI::App*) { return true; });
  }
  std::vector<const CLI::Option*> Options() const {
    return app->get_options([](const CLI::Option*) { return true; });
  }
};

// All commands, each before its subcommands.
void AddTree(const CLI::App& app, const std::string& name, std::vector<Command>& commands) {
  commands.push_back({name, &app});
  const Command command = commands.back();
  for (const CLI::App* subcommand : command.Subcommands()) {
    AddTree(*subcommand, absl::StrCat(name, name.empty() ? "" : " ", subcommand->get_name()), commands);
  }
}

std::vector<Command> TreeOf(const CLI::App& app) {
  std::vector<Command> commands;
  AddTree(app, "", commands);
  return commands;
}

bool IsPositional(const CLI::Option& option) { return option.get_positional(); }

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

// The names of an option with their dashes.
std::vector<std::string> NamesOf(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) {
    names.push_back("-" + name);
  }
  for (const std::string& name : option.get_lnames()) {
    names.push_back("--" + name);
  }
  return names;
}

// The values of an option that has a few only: CLI11 keeps them in the name of the type, "TEXT:{text,json}".
std::vector<std::string> ChoicesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t open = type.find('{');
  const size_t close = type.find('}', open);
  if (open == std::string::npos || close == std::string::npos) {
    return {};
  }
  return absl::StrSplit(type.substr(open + 1, close - open - 1), ',');
}

bool IsFile(const CLI::Option& option) { return option.get_type_name().compare(0, 4, "FILE") == 0; }

// A word of bash.
std::string Quoted(const std::string& text) {
  return absl::StrCat("'", absl::StrReplaceAll(text, {{"'", "'\\''"}}), "'");
}

// The alternatives of bash's `case` statements in the script.
struct CompletionCases {
  // What follows an option: one of its choices (by the choices, joined), a file, or a value that is not completed.
  void AddOption(const std::string& command, const CLI::Option& option);
  // The command's word, its options, and what else may follow it.
  void AddCommand(const Command& command);

  std::vector<std::string> names;
  std::map<std::string, std::vector<std::string>> patterns_of_choices;
  std::vector<std::string> file_patterns;
  std::vector<std::string> value_patterns;
  std::string words;
};

void CompletionCases::AddOption(const std::string& command, const CLI::Option& option) {
  const std::vector<std::string> choices = ChoicesOf(option);
  for (const std::string& name : NamesOf(option)) {
    const std::string pattern = Quoted(absl::StrCat(command, " ", name));
    if (!choices.empty()) {
      patterns_of_choices[absl::StrJoin(choices, " ")].push_back(pattern);
    } else if (IsFile(option)) {
      file_patterns.push_back(pattern);
    } else if (TakesValue(option)) {
      value_patterns.push_back(pattern);
    }
  }
}

void CompletionCases::AddCommand(const Command& command) {
  if (!command.name.empty()) {
    names.push_back(Quoted(command.name));
  }
  std::vector<std::string> options;
  std::vector<std::string> others;
  bool takes_files = false;
  for (const CLI::App* subcommand : command.Subcommands()) {
    others.push_back(subcommand->get_name());
  }
  for (const CLI::Option* option : command.Options()) {
    if (IsPositional(*option)) {
      takes_files = takes_files || IsFile(*option);
      const std::vector<std::string> choices = ChoicesOf(*option);
      others.insert(others.end(), choices.begin(), choices.end());
      continue;
    }
    const std::vector<std::string> option_names = NamesOf(*option);
    options.insert(options.end(), option_names.begin(), option_names.end());
    AddOption(command.name, *option);
  }
  absl::StrAppend(&words, "    ", Quoted(command.name), ") options=", Quoted(absl::StrJoin(options, " ")),
                  " words=", Quoted(absl::StrJoin(others, " ")), " files=", takes_files ? 1 : 0, " ;;\n");
}

}  // namespace

std::string BashCompletion(const CLI::App& app) {
  CompletionCases cases;
  for (const Command& command : TreeOf(app)) {
    cases.AddCommand(command);
  }
  std::string choices;
  for (const auto& [values, patterns] : cases.patterns_of_choices) {
    absl::StrAppend(&choices, "    ", absl::StrJoin(patterns, " | "), ")\n      COMPREPLY=($(compgen -W ",
                    Quoted(values), " -- \"${current}\"))\n      return ;;\n");
  }
  return absl::StrCat(
      "# Completion of `wellspace` for bash; made by: wellspace completion bash\n"
      "_wellspace() {\n"
      "  local current=\"${COMP_WORDS[COMP_CWORD]}\" previous=\"${COMP_WORDS[COMP_CWORD - 1]}\"\n"
      "  local command='' options='' words='' files=0 i\n"
      "  COMPREPLY=()\n"
      "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
      "    case \"${command}${command:+ }${COMP_WORDS[i]}\" in\n"
      "      ",
      absl::StrJoin(cases.names, " | "),
      ")\n"
      "        command=\"${command}${command:+ }${COMP_WORDS[i]}\" ;;\n"
      "    esac\n"
      "  done\n"
      "  case \"${command} ${previous}\" in\n",
      choices, "    ", absl::StrJoin(cases.file_patterns, " | "),
      ")\n"
      "      compopt -o filenames 2>/dev/null\n"
      "      COMPREPLY=($(compgen -f -- \"${current}\"))\n"
      "      return ;;\n"
      "    ",
      absl::StrJoin(cases.value_patterns, " | "),
      ") return ;;\n"
      "  esac\n"
      "  case \"${command}\" in\n",
      cases.words,
      "  esac\n"
      "  if [[ \"${current}\" == -* ]]; then\n"
      "    COMPREPLY=($(compgen -W \"${options}\" -- \"${current}\"))\n"
      "  elif ((files)); then\n"
      "    compopt -o filenames 2>/dev/null\n"
      "    COMPREPLY=($(compgen -f -- \"${current}\"))\n"
      "  else\n"
      "    COMPREPLY=($(compgen -W \"${words}\" -- \"${current}\"))\n"
      "  fi\n"
      "}\n"
      "complete -F _wellspace wellspace\n");
}

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

std::string ValueOf(const CLI::Option& option) {
  const std::vector<std::string> choices = ChoicesOf(option);
  return choices.empty() ? option.get_type_name().substr(0, option.get_type_name().find(':'))
                         : absl::StrJoin(choices, "|");
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
