#include "client/cli/completions.h"

#include <map>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "client/cli/command_tree.h"

namespace wellspace::cli {
namespace {

// A word of bash, and of zsh.
std::string Quoted(const std::string& text) {
  return absl::StrCat("'", absl::StrReplaceAll(text, {{"'", "'\\''"}}), "'");
}

// The alternatives of bash's `case` statements in the script.
struct CompletionCases {
  // The kind of word after an option: one of its choices (by the choices, joined), a file, or a value that is not
  // completed.
  void AddOption(const std::string& command, const CLI::Option& option);
  // The command's word, its options, and other words that may follow it.
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

// The patterns of all commands, for `case` of zsh and fish: 'mesh' 'session create' ...
std::vector<std::string> QuotedNames(const std::vector<Command>& commands) {
  std::vector<std::string> names;
  for (const Command& command : commands) {
    if (!command.name.empty()) {
      names.push_back(Quoted(command.name));
    }
  }
  return names;
}

// The word after an option or for a positional in a specification of zsh's _arguments.
std::string ZshValue(const CLI::Option& option) {
  const std::vector<std::string> choices = ChoicesOf(option);
  const std::string name = option.get_positional() ? option.get_name(true) : "value";
  return absl::StrCat(":", name, ":",
                      !choices.empty() ? absl::StrCat("(", absl::StrJoin(choices, " "), ")")
                      : IsFile(option) ? "_files"
                                       : " ");
}

// The specifications of a command without subcommands, for _arguments.
std::string ZshArguments(const Command& command) {
  std::string specifications;
  for (const CLI::Option* option : command.Options()) {
    if (IsPositional(*option)) {
      const bool is_many = option->get_items_expected_max() > 1;
      absl::StrAppend(&specifications, " \\\n        ", Quoted(absl::StrCat(is_many ? "*" : "", ZshValue(*option))));
      continue;
    }
    const std::string description =
        absl::StrReplaceAll(option->get_description(), {{"\\", "\\\\"}, {"[", "\\["}, {"]", "\\]"}, {":", "\\:"}});
    for (const std::string& name : NamesOf(*option)) {
      // The star: options may come several times.
      absl::StrAppend(
          &specifications, " \\\n        ",
          Quoted(absl::StrCat("*", name, "[", description, "]", TakesValue(*option) ? ZshValue(*option) : "")));
    }
  }
  return absl::StrCat("      _arguments -S", specifications, " ;;\n");
}

// The subcommands of a command, each with its description.
std::string ZshSubcommands(const Command& command) {
  std::string described;
  for (const CLI::App* subcommand : command.Subcommands()) {
    absl::StrAppend(
        &described, " ",
        Quoted(absl::StrCat(subcommand->get_name(), ":",
                            absl::StrReplaceAll(subcommand->get_description(), {{"\\", "\\\\"}, {":", "\\:"}}))));
  }
  return absl::StrCat("      commands=(", described.substr(1), ")\n      _describe command commands ;;\n");
}

}  // namespace

std::string ZshCompletion(const CLI::App& app) {
  const std::vector<Command> commands = TreeOf(app);
  std::string cases;
  for (const Command& command : commands) {
    absl::StrAppend(&cases, "    (", Quoted(command.name), ")\n",
                    command.Subcommands().empty() ? ZshArguments(command) : ZshSubcommands(command));
  }
  return absl::StrCat(
      "#compdef wellspace\n"
      "# Completion of `wellspace` for zsh; made by: wellspace completion zsh\n"
      "_wellspace() {\n"
      "  local command='' i skipped=0\n"
      "  local -a commands\n"
      "  for ((i = 2; i < CURRENT; ++i)); do\n"
      "    case \"${command}${command:+ }${words[i]}\" in\n"
      "      (",
      absl::StrJoin(QuotedNames(commands), " | "),
      ")\n"
      "        command=\"${command}${command:+ }${words[i]}\"\n"
      "        skipped=$((i - 1)) ;;\n"
      "    esac\n"
      "  done\n"
      "  shift ${skipped} words\n"
      "  ((CURRENT -= skipped))\n"
      "  case \"${command}\" in\n",
      cases,
      "  esac\n"
      "}\n"
      "_wellspace \"$@\"\n");
}

namespace {

// A word of fish.
std::string FishQuoted(const std::string& text) {
  return absl::StrCat("'", absl::StrReplaceAll(text, {{"\\", "\\\\"}, {"'", "\\'"}}), "'");
}

// The offers of the shell for the value of an option or a positional.
std::string FishValue(const CLI::Option& option) {
  const std::vector<std::string> choices = ChoicesOf(option);
  return !choices.empty() ? absl::StrCat(" -a ", FishQuoted(absl::StrJoin(choices, " "))) : IsFile(option) ? " -F" : "";
}

std::string FishCommand(const Command& command) {
  const std::string prefix =
      absl::StrCat("complete -c wellspace -n ",
                   FishQuoted(absl::StrCat("test \"$(__wellspace_command)\" = \"", command.name, "\"")));
  std::string lines;
  for (const CLI::App* subcommand : command.Subcommands()) {
    absl::StrAppend(&lines, prefix, " -a ", FishQuoted(subcommand->get_name()), " -d ",
                    FishQuoted(subcommand->get_description()), "\n");
  }
  for (const CLI::Option* option : command.Options()) {
    if (IsPositional(*option)) {
      const std::string value = FishValue(*option);
      absl::StrAppend(&lines, value.empty() ? "" : absl::StrCat(prefix, value, "\n"));
      continue;
    }
    std::string names;
    for (const std::string& name : option->get_snames()) {
      absl::StrAppend(&names, " -s ", name);
    }
    for (const std::string& name : option->get_lnames()) {
      absl::StrAppend(&names, " -l ", name);
    }
    absl::StrAppend(&lines, prefix, names,
                    TakesValue(*option) ? absl::StrCat(IsFile(*option) ? " -r" : " -x", FishValue(*option)) : "",
                    " -d ", FishQuoted(option->get_description()), "\n");
  }
  return lines;
}

}  // namespace

std::string FishCompletion(const CLI::App& app) {
  const std::vector<Command> commands = TreeOf(app);
  std::string lines;
  for (const Command& command : commands) {
    lines += FishCommand(command);
  }
  return absl::StrCat(
      "# Completion of `wellspace` for fish; made by: wellspace completion fish\n"
      "function __wellspace_command\n"
      "  set -l command\n"
      "  for word in (commandline -opc)[2..-1]\n"
      "    switch (string join ' ' -- $command $word)\n"
      "      case ",
      absl::StrJoin(QuotedNames(commands), " "),
      "\n"
      "        set -a command $word\n"
      "    end\n"
      "  end\n"
      "  string join ' ' -- $command\n"
      "end\n"
      "complete -c wellspace -f\n",
      lines);
}

}  // namespace wellspace::cli
