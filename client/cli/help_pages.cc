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

// The parts of a page. Texts are plain but for words in backticks, which are names that the reader types.
class Page {
 public:
  virtual ~Page() = default;
  virtual void Heading(const std::string& text) = 0;
  virtual void CommandHeading(const std::string& synopsis) = 0;
  virtual void Paragraph(const std::string& text) = 0;
  virtual void Verbatim(const std::string& text) = 0;
  // Entries follow one another in a list, which EndList ends. `value` follows the names; it may be empty.
  virtual void Entry(const std::vector<std::string>& names, const std::string& value, const std::string& text) = 0;
  virtual void EndList() = 0;

  std::string text() const { return text_; }

 protected:
  std::string text_;
};

// In the macros of man(7).
class ManPage : public Page {
 public:
  explicit ManPage(const std::string& start) { text_ = start; }

  void Heading(const std::string& text) override {
    absl::StrAppend(&text_, ".SH ", Escaped(absl::AsciiStrToUpper(text)), "\n");
  }
  void CommandHeading(const std::string& synopsis) override {
    absl::StrAppend(&text_, ".SS \"", Escaped(synopsis), "\"\n");
  }
  void Paragraph(const std::string& text) override { absl::StrAppend(&text_, ".PP\n", Marked(text), "\n"); }
  void Verbatim(const std::string& text) override {
    text_ += ".PP\n.nf\n";
    for (const auto& line : absl::StrSplit(absl::StripTrailingAsciiWhitespace(text), '\n')) {
      absl::StrAppend(&text_, Escaped(std::string(line)), "\n");
    }
    text_ += ".fi\n";
  }
  void Entry(const std::vector<std::string>& names, const std::string& value, const std::string& text) override {
    std::vector<std::string> bold;
    for (const std::string& name : names) {
      bold.push_back(absl::StrCat("\\fB", Escaped(name), "\\fR"));
    }
    // Choices may go on in the next line.
    const std::string breakable = absl::StrReplaceAll(Escaped(value), {{"|", "|\\:"}});
    absl::StrAppend(&text_, ".TP\n", absl::StrJoin(bold, ", "), names.empty() || value.empty() ? "" : " ",
                    value.empty() ? "" : absl::StrCat("\\fI", breakable, "\\fR"), "\n", Marked(text), "\n");
  }
  void EndList() override {}

 private:
  static std::string Escaped(const std::string& text) {
    std::string escaped =
        absl::StrReplaceAll(text, {{"\\", "\\e"}, {"-", "\\-"}, {"'", "\\(aq"}, {"\"", "\\(dq"}, {"\u00b7", "\\(pc"}});
    if (!escaped.empty() && escaped[0] == '.') {
      escaped.insert(0, "\\&");
    }
    return escaped;
  }

  static std::string Marked(const std::string& text) {
    std::string marked;
    bool bold = false;
    for (const auto& part : absl::StrSplit(text, '`')) {
      const std::string escaped = Escaped(std::string(part));
      marked += bold ? absl::StrCat("\\fB", escaped, "\\fR") : escaped;
      bold = !bold;
    }
    return marked;
  }
};

// As GitHub shows it.
class MarkdownPage : public Page {
 public:
  explicit MarkdownPage(const std::string& start) { text_ = start; }

  void Heading(const std::string& text) override { absl::StrAppend(&text_, "\n## ", text, "\n"); }
  void CommandHeading(const std::string& synopsis) override { absl::StrAppend(&text_, "\n### `", synopsis, "`\n"); }
  void Paragraph(const std::string& text) override {
    text_ += "\n";
    size_t width = 0;
    for (const auto& part : absl::StrSplit(Escaped(text), ' ')) {
      const std::string word(part);
      const bool is_first = width == 0;
      const bool fits = is_first || width + 1 + word.size() <= kWidth;
      absl::StrAppend(&text_, is_first ? "" : fits ? " " : "\n", word);
      width = fits && !is_first ? width + 1 + word.size() : word.size();
    }
    text_ += "\n";
  }
  void Verbatim(const std::string& text) override {
    absl::StrAppend(&text_, "\n```\n", absl::StripTrailingAsciiWhitespace(text), "\n```\n");
  }
  void Entry(const std::vector<std::string>& names, const std::string& value, const std::string& text) override {
    if (!in_list_) {
      text_ += "\n| | |\n| --- | --- |\n";
      in_list_ = true;
    }
    std::string name = absl::StrJoin(names, ", ");
    absl::StrAppend(&name, name.empty() || value.empty() ? "" : " ", value);
    absl::StrAppend(&text_, "| `", absl::StrReplaceAll(name, {{"|", "\\|"}}), "` | ",
                    absl::StrReplaceAll(Escaped(text), {{"|", "\\|"}, {"\n", " "}}), " |\n");
  }
  void EndList() override { in_list_ = false; }

 private:
  static std::string Escaped(const std::string& text) {
    return absl::StrReplaceAll(text, {{"<", "&lt;"}, {"*", "\\*"}, {"_", "\\_"}});
  }

  static constexpr size_t kWidth = 120;

  bool in_list_ = false;
};

void DescribeOption(const CLI::Option& option, Page& page) {
  std::string text = option.get_description();
  if (!option.get_envname().empty()) {
    absl::StrAppend(&text, "; or the environment's ", option.get_envname());
  }
  if (IsPositional(option)) {
    page.Entry({}, option.get_name(true), text);
  } else {
    page.Entry(NamesOf(option), TakesValue(option) ? ValueOf(option) : "", text);
  }
}

void DescribeCommand(const Command& command, Page& page) {
  std::string synopsis = absl::StrCat("wellspace ", command.name);
  std::vector<const CLI::Option*> positionals;
  std::vector<const CLI::Option*> options;
  for (const CLI::Option* option : command.Options()) {
    (IsPositional(*option) ? positionals : options).push_back(option);
    if (IsPositional(*option)) {
      const bool many = option->get_items_expected_max() > 1;
      const std::string name = absl::StrCat(option->get_name(true), many ? "..." : "");
      absl::StrAppend(&synopsis, " ", option->get_required() ? name : absl::StrCat("[", name, "]"));
    }
  }
  page.CommandHeading(synopsis + " [options]");
  page.Paragraph(command.app->get_description() + ".");
  for (const std::vector<const CLI::Option*>* group : {&positionals, &options}) {
    for (const CLI::Option* option : *group) {
      DescribeOption(*option, page);
    }
  }
  page.EndList();
  // The exit codes have a section of their own.
  const std::string footer = absl::StrReplaceAll(command.app->get_footer(), {{kExitCodesHelp, ""}});
  if (!absl::StripAsciiWhitespace(footer).empty()) {
    page.Verbatim(std::string(absl::StripPrefix(footer, "\n")));
  }
}

// The sections that both pages have.
void DescribeTool(const CLI::App& app, Page& page) {
  page.Heading("Description");
  page.Paragraph(
      "A point cloud, or a domain in the plane, becomes a mesh in one call of `mesh`, in this process or on a server. "
      "On a server a session keeps points and mesh between calls: `session create`, `upload`, `refine`, `download`; "
      "then `add` or `upload` more points, and `refine` again, at the cost of what is new.");
  page.Paragraph(
      "Results go to standard output, progress and errors to standard error. With `--output json` results are JSON, "
      "and errors a JSON object in one line. Files named `-` are standard input or output. Ctrl-C cancels the work of "
      "`mesh`, `estimate` and `refine`, and ends the others.");
  page.Heading("Commands");
  std::map<std::string, std::string> environment;
  for (const Command& command : TreeOf(app)) {
    for (const CLI::Option* option : command.Options()) {
      if (!option->get_envname().empty()) {
        environment[option->get_envname()] = option->get_lnames().front();
      }
    }
    if (!command.name.empty() && command.Subcommands().empty()) {
      DescribeCommand(command, page);
    }
  }
  page.Heading("Exit status");
  page.Verbatim(kExitCodesHelp);
  page.Heading("Environment");
  for (const auto& [name, option] : environment) {
    page.Entry({name}, "", absl::StrCat("The default of `--", option, "`."));
  }
  page.EndList();
}

std::string Summary(const CLI::App& app) {
  const std::string description = app.get_description();
  return absl::AsciiStrToLower(description.substr(0, 1)) + description.substr(1);
}

}  // namespace

std::string ManualPage(const CLI::App& app, const std::string& version) {
  ManPage page(absl::StrCat(".TH WELLSPACE 1 \"\" \"wellspace ", version,
                            "\" \"User Commands\"\n.ad l\n.SH NAME\nwellspace \\- ", Summary(app),
                            "\n.SH SYNOPSIS\n\\fBwellspace\\fR \\fIcommand\\fR [\\fIoptions\\fR]\n"));
  DescribeTool(app, page);
  page.Heading("See also");
  page.Paragraph("`wellspaced`(8)");
  return page.text();
}

std::string MarkdownManual(const CLI::App& app) {
  MarkdownPage page(absl::StrCat("# The tool `wellspace`: ", Summary(app), "\n"));
  page.Paragraph("This page is `wellspace manual --format markdown`; the same is the manual page wellspace(1).");
  DescribeTool(app, page);
  return page.text();
}

}  // namespace wellspace::cli
