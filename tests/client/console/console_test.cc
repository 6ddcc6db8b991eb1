// The console over HTTP, in front of a server in this process: requests of its page, and requests that are refused.
#include "client/console/console.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/connection.h"
#include "client/console/http_server.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/zip_file.h"
#include "client/retry_policy.h"
#include "grpcpp/grpcpp.h"
#include "server/embedded_server.h"
#include "tests/support/temporary_folder.h"
#include "wellspace/v1/meshing.grpc.pb.h"

namespace wellspace::console {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kTriangle[] = R"({"type": "Polygon", "coordinates": [[[0,0],[4,0],[4,3],[0,0]]]})";
constexpr uint64_t kMostBytes = 100'000;

struct Answer {
  int status = 0;
  std::string head;
  std::string body;
  json value() const { return json::parse(body); }
};

class ConsoleTest : public ::testing::Test {
 protected:
  ConsoleTest()
      : console_(client::Client(client::MakeConnection(server_.Channel())), {.folder = folder_.Path("")}),
        http_(*HttpServer::Start({.token = MakeToken(), .folder = folder_.Path(""), .max_body_bytes = kMostBytes},
                                 [this](const HttpRequest& request) { return console_.Answer(request); })) {}

  int Connect() const {
    const int peer = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(http_->port()));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(peer, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    return peer;
  }

  // Sends bytes as they are, and reads until the end.
  std::string Exchange(const std::string& bytes) const {
    const int peer = Connect();
    EXPECT_EQ(send(peer, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
    std::string answer;
    char buffer[4096];
    for (ssize_t got = 0; (got = read(peer, buffer, sizeof(buffer))) > 0;) {
      answer.append(buffer, static_cast<size_t>(got));
    }
    close(peer);
    return answer;
  }

  Answer Ask(const std::string& method, const std::string& path, const std::string& body = "",
             const std::string& headers = "") const {
    const std::string url = http_->url();
    const std::string prefix = url.substr(url.find('/', 7));
    std::string request = method + " " + prefix + path + " HTTP/1.1\r\nConnection: close\r\n" + headers;
    if (headers.find("Host:") == std::string::npos) {
      request += "Host: 127.0.0.1:" + std::to_string(http_->port()) + "\r\n";
    }
    if (method == "POST") {
      request += "Content-Length: " + std::to_string(body.size()) + "\r\n";
    }
    const std::string answer = Exchange(request + "\r\n" + body);
    Answer parsed;
    const size_t end = answer.find("\r\n\r\n");
    if (answer.size() > 12 && end != std::string::npos) {
      parsed.status = std::stoi(answer.substr(9, 3));
      parsed.head = answer.substr(0, end);
      parsed.body = answer.substr(end + 4);
    }
    return parsed;
  }

  // Sends a file, waits for its mesh, and returns the name of the session.
  std::string Mesh(const std::string& name, const std::string& file, const std::string& more = "") const {
    const Answer uploaded = Ask("POST", "api/sessions?name=" + name + more, file);
    EXPECT_EQ(uploaded.status, 200) << uploaded.body;
    const std::string operation = uploaded.value()["operation"]["name"];
    client::Client client(client::MakeConnection(server_.Channel()));
    const absl::StatusOr<client::Operation> ended = client.WatchOperation(operation);
    EXPECT_TRUE(ended.ok() && ended->error.ok()) << ended->error;
    return operation.substr(0, operation.find("/operations"));
  }

  mutable server::EmbeddedServer server_{1};
  const TemporaryFolder folder_;
  Console console_;
  const std::unique_ptr<HttpServer> http_;
};

// A server behind a proxy that passes this service alone.
class WithoutHealth final : public v1::MeshingService::Service {
  grpc::Status GetServerInfo(grpc::ServerContext* /*context*/, const v1::GetServerInfoRequest* /*request*/,
                             v1::GetServerInfoResponse* response) override {
    response->set_version("7.7");
    return grpc::Status::OK;
  }
};

TEST(ConsoleOfAProxy, ShowsTheServerWhoseHealthIsUnknown) {
  WithoutHealth service;
  grpc::ServerBuilder builder;
  const std::unique_ptr<grpc::Server> server = builder.RegisterService(&service).BuildAndStart();
  const TemporaryFolder folder;
  client::RetryPolicy once;
  once.max_attempts = 1;
  Console console(client::Client(client::MakeConnection(server->InProcessChannel({}), once)),
                  {.folder = folder.Path("")});
  const HttpAnswer answer = console.Answer({.method = "GET", .path = "api/server"});
  EXPECT_EQ(answer.status, 200) << answer.body;
  const json figures = json::parse(answer.body);
  EXPECT_EQ(figures["health"], "unknown");
  EXPECT_EQ(figures["info"]["version"], "7.7");
}

TEST_F(ConsoleTest, ThePageIsServedWithStrictRules) {
  const Answer page = Ask("GET", "");
  EXPECT_EQ(page.status, 200);
  EXPECT_THAT(page.head, HasSubstr("Content-Type: text/html"));
  EXPECT_THAT(page.head, HasSubstr("Content-Security-Policy: frame-ancestors 'none'"));
  EXPECT_THAT(page.head, HasSubstr("X-Content-Type-Options: nosniff"));
  EXPECT_THAT(page.head, HasSubstr("Referrer-Policy: no-referrer"));
  EXPECT_THAT(page.head, HasSubstr("Cache-Control: no-store"));
  EXPECT_THAT(page.body,
              HasSubstr("http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'sha256-"));
  EXPECT_TRUE(Ask("HEAD", "").body.empty());
  EXPECT_THAT(Ask("GET", "api/server").head, HasSubstr("Content-Security-Policy: default-src 'none'"));
}

TEST_F(ConsoleTest, ADomainBecomesAMesh) {
  const std::string session = Mesh("lake%20%3Cb%3E.geojson", kTriangle, "&parameters=%7B%22max_circumradius%22:0.2%7D");
  const json list = Ask("GET", "api/sessions").value();
  ASSERT_EQ(list["sessions"].size(), 1u);
  EXPECT_FALSE(list["more"].get<bool>());
  const json& one = list["sessions"][0];
  EXPECT_EQ(one["session"]["name"], session);
  EXPECT_EQ(one["session"]["labels"]["file"], "lake <b>.geojson");
  EXPECT_EQ(one["session"]["parameters"]["max_circumradius"], 0.2);
  EXPECT_EQ(one["session"]["segment_count"], 3);
  EXPECT_EQ(one["operation"]["state"], "succeeded");
  EXPECT_TRUE(one["seconds_left"].is_null());
  const json statistics = Ask("GET", "api/" + session + "/statistics").value();
  EXPECT_EQ(statistics["vertices"], one["session"]["vertex_count"]);
  EXPECT_GT(statistics["vertices"], 30);
  EXPECT_EQ(statistics["domain"]["segments"], 3);
}

TEST_F(ConsoleTest, ASurfaceMeansItsInside) {
  constexpr char kTetrahedron[] =
      "4 3 0 0\n1 1 1 1\n2 1 -1 -1\n3 -1 1 -1\n4 -1 -1 1\n4 0\n3 1 2 3\n3 1 4 2\n3 1 3 4\n3 2 4 3\n0\n";
  const std::string session =
      Mesh("part.smesh", kTetrahedron, "&parameters=%7B%22surface%22:%7B%22tolerance%22:0.01%7D%7D");
  const json one = Ask("GET", "api/sessions").value()["sessions"][0];
  EXPECT_EQ(one["session"]["triangle_count"], 4);
  const json statistics = Ask("GET", "api/" + session + "/statistics").value();
  EXPECT_EQ(statistics["surface"]["triangles"], 4);
  EXPECT_NEAR(statistics["surface"]["volumes"][0].get<double>(), 8.0 / 3, 1e-9);
}

TEST_F(ConsoleTest, AMeshIsDownloadedAndShown) {
  const std::string session = Mesh("points.csv", "0,0,0\n1,0,0\n0,1,0\n0,0,1\n1,1,1\n");
  const json server = Ask("GET", "api/server").value();
  EXPECT_EQ(server["health"], "serving");
  EXPECT_GT(server["formats"]["3"].size(), 10u);
  for (const std::string format : server["formats"]["3"]) {
    const Answer file = Ask("GET", session + "/mesh?format=" + format);
    EXPECT_EQ(file.status, 200) << format << file.body;
    EXPECT_THAT(file.head, HasSubstr("Content-Disposition: attachment; filename=\"mesh.")) << format;
    EXPECT_GT(file.body.size(), 100u) << format;
  }
  const json in_plane = server["formats"]["2"];
  for (const std::string format : {"adcirc", "2dm"}) {
    EXPECT_TRUE(std::find(in_plane.begin(), in_plane.end(), format) != in_plane.end()) << in_plane;
    const Answer refused = Ask("GET", session + "/mesh?format=" + format);
    EXPECT_EQ(refused.status, 400) << format;
    EXPECT_THAT(refused.body, Not(HasSubstr("/tmp"))) << format;
  }
  const Answer page = Ask("GET", session + "/view");
  EXPECT_EQ(page.status, 200);
  EXPECT_THAT(page.head, HasSubstr("frame-ancestors 'self'"));
  EXPECT_THAT(page.body, HasSubstr("points.csv"));
  EXPECT_EQ(folder_.FileCount(), 0);
}

TEST_F(ConsoleTest, FormatsOfSeveralFilesAreArchives) {
  const std::string session = Mesh("points.csv", "0,0,0\n1,0,0\n0,1,0\n0,0,1\n1,1,1\n");
  const std::map<std::string, std::vector<std::string>> members = {
      {"node", {"mesh.node", "mesh.ele", "mesh.face"}},
      {"xdmf", {"mesh.xdmf", "mesh.h5", "mesh_boundary.xdmf", "mesh_boundary.h5"}}};
  for (const auto& [format, names] : members) {
    const Answer file = Ask("GET", session + "/mesh?format=" + format);
    ASSERT_EQ(file.status, 200) << file.body;
    EXPECT_THAT(file.head, HasSubstr("filename=\"mesh." + format + ".zip\""));
    const std::string path = folder_.Path("got.zip");
    std::ofstream(path, std::ios::binary) << file.body;
    const std::unique_ptr<formats::ZipReader> archive = *formats::ZipReader::Open(*formats::InputFile::Open(path));
    for (const std::string& name : names) {
      EXPECT_TRUE(archive->Has(name)) << name;
      EXPECT_GT(archive->Begin(name).value_or(0), 20u) << name;
    }
    std::filesystem::remove(path);
  }
  EXPECT_EQ(folder_.FileCount(), 0);
}

TEST_F(ConsoleTest, AMeshIsRefinedCancelledAndDeleted) {
  const std::string session = Mesh("points.csv", "0,0\n1,0\n0,1\n1,1\n0.5,0.4\n");
  const Answer refined = Ask("POST", "api/" + session + "/refine?parameters=%7B%22max_circumradius%22:0.1%7D");
  ASSERT_EQ(refined.status, 200) << refined.body;
  EXPECT_EQ(refined.value()["operation"]["parameters"]["max_circumradius"], 0.1);
  // It may have ended by then, which a cancel leaves as it is.
  EXPECT_EQ(Ask("POST", "api/" + session + "/cancel").status, 200);
  EXPECT_EQ(Ask("DELETE", "api/" + session).status, 200);
  EXPECT_EQ(Ask("DELETE", "api/" + session).status, 404);
  EXPECT_EQ(Ask("GET", "api/sessions").value()["sessions"].size(), 0u);
}

TEST_F(ConsoleTest, WrongFilesLeaveNoSession) {
  const std::map<std::string, std::string> wrong = {{"points.csv", "0,0\n1,x\n"},
                                                    {"lake.geojson", R"({"type": "Pol"})"},
                                                    {"cross.poly", "4 2 0 0\n1 0 0\n2 2 2\n3 0 2\n"},
                                                    {"points.nothing", "0 0\n"},
                                                    {"", "0 0\n"},
                                                    {"empty.csv", ""}};
  for (const auto& [name, file] : wrong) {
    const Answer answer = Ask("POST", "api/sessions?name=" + name, file);
    EXPECT_EQ(answer.status, 400) << name << answer.body;
    EXPECT_EQ(answer.value()["code"], "INVALID_ARGUMENT") << name;
    EXPECT_THAT(answer.body, Not(HasSubstr("/tmp"))) << name;
  }
  EXPECT_THAT(Ask("POST", "api/sessions?name=points.csv", "0,0\n1,x\n").value()["message"].get<std::string>(),
              HasSubstr("points.csv:2"));
  EXPECT_EQ(Ask("POST", "api/sessions?name=a.csv&parameters=%7B", "0,0\n").status, 400);
  EXPECT_EQ(Ask("POST", "api/sessions?name=a.csv&crossings=maybe", "0,0\n").status, 400);
  EXPECT_EQ(Ask("POST", "api/sessions?name=a.csv&parameters=%7B%22rho%22:-1%7D", "0,0\n").status, 400);
  EXPECT_EQ(Ask("GET", "api/sessions").value()["sessions"].size(), 0u);
  EXPECT_EQ(folder_.FileCount(), 0);
}

TEST_F(ConsoleTest, WhatIsNotThereIsNotFound) {
  for (const char* path : {"x", "api/", "api/x", "api/sessions/none/statistics", "sessions/none/view", "sessions/none",
                           "api/sessions/none/x", "sessions/../../etc/passwd", "sessions/none/mesh?format=vtu"}) {
    EXPECT_EQ(Ask("GET", path).status, 404) << path;
  }
  EXPECT_EQ(Ask("GET", "sessions/none/mesh?format=../x").status, 400);
  EXPECT_EQ(Ask("POST", "api/server").status, 404);
  EXPECT_EQ(Ask("DELETE", "api/sessions/none").status, 404);
}

TEST_F(ConsoleTest, OtherPagesAreRefused) {
  EXPECT_EQ(Ask("GET", "api/server", "", "Origin: http://evil.example\r\n").status, 403);
  EXPECT_EQ(Ask("POST", "api/sessions?name=a.csv", "0,0\n", "Origin: null\r\n").status, 403);
  EXPECT_EQ(Ask("GET", "api/server", "", "Host: evil.example\r\n").status, 421);
  EXPECT_EQ(Ask("GET", "sessions/x/view", "", "Sec-Fetch-Site: cross-site\r\n").status, 403);
  EXPECT_EQ(Ask("PUT", "api/server").status, 405);
  const std::string without_secret = Exchange(
      "GET /api/server HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(http_->port()) + "\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(without_secret, HasSubstr("404"));
  EXPECT_EQ(Ask("GET", "api/sessions").value()["sessions"].size(), 0u);
}

TEST_F(ConsoleTest, LargeAndBrokenRequestsAreRefused) {
  EXPECT_EQ(Ask("POST", "api/sessions?name=a.csv", std::string(kMostBytes + 1, '1')).status, 413);
  // Without a length, in chunks.
  const std::string url = http_->url();
  std::string chunked = "POST " + url.substr(url.find('/', 7)) +
                        "api/sessions?name=a.csv HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(http_->port()) +
                        "\r\nTransfer-Encoding: chunked\r\nConnection: close\r\n\r\n";
  for (int i = 0; i < 3; ++i) {
    chunked += "c350\r\n" + std::string(50'000, '1') + "\r\n";
  }
  EXPECT_THAT(Exchange(chunked + "0\r\n\r\n"), HasSubstr(" 413 "));
  EXPECT_EQ(Ask("GET", "api/server", "", "X: " + std::string(2 * HttpServer::kMaxHeadBytes, 'x') + "\r\n").status / 100,
            4);
  EXPECT_THAT(Exchange("nonsense\r\n\r\n"), Not(HasSubstr(" 200 ")));
  EXPECT_EQ(folder_.FileCount(), 0);
  EXPECT_EQ(Ask("GET", "api/server").status, 200);
}

TEST_F(ConsoleTest, AServerThatIsGoneIsTold) {
  Console gone(*client::Connect("127.0.0.1:1"), {.server = "127.0.0.1:1", .folder = folder_.Path("")});
  const HttpAnswer answer = gone.Answer({.method = "GET", .path = "api/server"});
  EXPECT_EQ(answer.status, 503);
  EXPECT_EQ(json::parse(answer.body)["code"], "UNAVAILABLE");
}

TEST_F(ConsoleTest, ManyAsksAtOnceAreAnswered) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([this] {
      for (int k = 0; k < 10; ++k) {
        EXPECT_EQ(Ask("GET", "api/sessions").status, 200);
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
}

}  // namespace
}  // namespace wellspace::console
