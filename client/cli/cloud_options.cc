#include "client/cli/cloud_options.h"

#include <iostream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"

namespace wellspace::cli {

void AddCloudOptions(CLI::App& command, formats::CloudOptions& options, const std::string& what,
                     const std::vector<std::string>& more_formats) {
  std::vector<std::string> all_formats = formats::CloudFormats();
  all_formats.insert(all_formats.end(), more_formats.begin(), more_formats.end());
  command.add_option("--input-format", options.format, absl::StrCat("Format of ", what, "; default: by its extension"))
      ->check(CLI::IsMember(all_formats));
  const auto parse = [&options](const std::string& text) {
    options.columns.clear();
    formats::FieldSplitter fields(text, ',');
    for (std::string_view field; fields.Next(field);) {
      if (field.empty()) {
        throw CLI::ValidationError(
            "--columns", absl::StrCat("expected names or numbers separated by commas, got ", formats::Quote(text)));
      }
      options.columns.emplace_back(field);
    }
    if (options.columns.empty()) {
      throw CLI::ValidationError("--columns", "expected names or numbers separated by commas, got \"\"");
    }
  };
  command
      .add_option_function<std::string>(
          "--columns", parse,
          absl::StrCat("Columns of ", what,
                       " that are the coordinates, in this order: names, or numbers from 1; "
                       "default: those with names such as x, y, z or lon, lat, otherwise all"))
      ->type_name("COLUMN,...");
  command.add_flag("--skip-invalid", options.skip_invalid,
                   absl::StrCat("Leave out points of ", what,
                                " with a coordinate that is missing (empty, NA), NaN or "
                                "infinite, and say how many; default: the first one is an error"));
}

CloudReport ReportOf(const formats::CloudOptions& options, std::vector<std::string> notes, uint64_t skipped) {
  return {.notes = std::move(notes),
          .skipped_points = options.skip_invalid ? std::make_optional(skipped) : std::nullopt};
}

void PrintNotes(const CloudReport& report, OutputFormat format, bool quiet) {
  if (format == OutputFormat::kJson) {
    return;
  }
  for (const std::string& note : report.notes) {
    // The count of points that are lost is the last note, and a result.
    if (!quiet || (report.skipped_points.value_or(0) > 0 && &note == &report.notes.back())) {
      std::cerr << "wellspace: note: " << note << "\n";
    }
  }
}

void AddNotes(const CloudReport& report, client::Json& json) {
  if (report.skipped_points.has_value()) {
    json["skipped_points"] = *report.skipped_points;
  }
  if (report.skipped_sizes.has_value()) {
    json["skipped_sizes"] = *report.skipped_sizes;
  }
  if (!report.notes.empty()) {
    json["notes"] = report.notes;
  }
}

std::string WithNotes(const CloudReport& report, const std::string& object) {
  client::Json notes = client::Json::object();
  AddNotes(report, notes);
  if (notes.empty()) {
    return object;
  }
  std::string text = client::JsonText(notes, /*indented=*/true);
  // "{\n  …\n}" and "{\n  …": the end of the one gives way to the other's members.
  text.replace(text.rfind("\n}"), std::string::npos, ",");
  return text + object.substr(object.find('\n'));
}

}  // namespace wellspace::cli
