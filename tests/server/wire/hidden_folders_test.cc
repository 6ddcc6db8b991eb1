// Folders of the server stay out of what clients see.
#include "server/wire/hidden_folders.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

TEST(HiddenFolders, AreLeftOutOfWhatClientsSee) {
  HideFolder("/srv/hidden/data/");
  HideFolder("/srv/hidden/data/inner");
  HideFolder("/");
  EXPECT_EQ(WithoutFolders("/srv/hidden/data/files/aa.points: it ends"), "files/aa.points: it ends");
  EXPECT_EQ(WithoutFolders("no room: /srv/hidden/data/ballast, '/srv/hidden/data/lock'"), "no room: ballast, 'lock'");
  EXPECT_EQ(WithoutFolders("/srv/hidden/data: cannot be listed"), "the folder of sessions: cannot be listed");
  EXPECT_EQ(WithoutFolders("at /srv/hidden/data"), "at the folder of sessions");
  EXPECT_EQ(WithoutFolders("/srv/hidden/data/inner/x"), "x") << "the inner one first";
  for (const char* other : {"", "/srv/hidden/database", "/a/srv/hidden/data/x", "/srv/hidden", "a/b: 1"}) {
    EXPECT_EQ(WithoutFolders(other), other);
  }
}

TEST(HiddenFolders, ARelativeFolderIsHiddenWhereItIsAbsolute) {
  HideFolder("./hidden_relative");
  const std::string absolute = std::filesystem::current_path().string() + "/hidden_relative";
  EXPECT_EQ(WithoutFolders(absolute + "/x"), "x");
  EXPECT_EQ(WithoutFolders("./hidden_relative/x"), "./hidden_relative/x") << "as the server was told, and no more";
}

TEST(HiddenFolders, WhatADatabaseSaysIsLeftOut) {
  const std::string message =
      absl::StrCat("no connection", std::string(kDatabaseSays), "connection to server at \"db.internal\" failed");
  EXPECT_EQ(WithoutFolders(message), "no connection");
  const grpc::Status seen = ToGrpcStatus(MakeError(v1::ERROR_REASON_STORE_FAILED, message));
  EXPECT_EQ(seen.error_message(), "no connection");
  EXPECT_EQ(seen.error_details().find("internal"), std::string::npos);
}

TEST(HiddenFolders, NoStatusOfACallHasThem) {
  HideFolder("/srv/hidden/status");
  const absl::Status status = MakeError(v1::ERROR_REASON_FILE_DAMAGED, "/srv/hidden/status/files/a: is damaged", "a");
  const grpc::Status seen = ToGrpcStatus(status);
  EXPECT_EQ(seen.error_message(), "files/a: is damaged");
  EXPECT_EQ(seen.error_details().find("/srv"), std::string::npos);
  EXPECT_EQ(StatusToProto(absl::CancelledError("/srv/hidden/status/files/a")).message(), "files/a");
}

}  // namespace
}  // namespace wellspace::server
