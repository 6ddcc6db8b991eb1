// The cost of losing nothing: commits, uploads, starts, meshes in files, and calls beside uploads. Prints a
// table.
//
//   bench_durability FOLDER     on the disk to be measured; its files are removed again
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "grpcpp/grpcpp.h"
#include "grpcpp/support/slice.h"
#include "proto/checksum.h"
#include "server/server.h"
#include "server/store/check_data.h"
#include "server/store/durable_log.h"
#include "server/store/memory_mesh.h"
#include "spdlog/logger.h"
#include "wellspace/v1/operations.grpc.pb.h"
#include "wellspace/v1/sessions.grpc.pb.h"

namespace wellspace::server {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

void Check(const absl::Status& status) {
  if (!status.ok()) {
    std::fprintf(stderr, "bench_durability: %s\n", status.ToString().c_str());
    std::exit(1);
  }
}

template <typename Value>
Value Get(absl::StatusOr<Value> value) {
  Check(value.status());
  return *std::move(value);
}

std::unique_ptr<SessionLog> OpenLog(const std::string& folder) { return Get(OpenDurableLog({.folder = folder})); }

SessionChange MakeCreation(SessionLog& log, uint64_t number) {
  SessionChange change{.session = absl::StrCat("sessions/", absl::Hex(number, absl::kZeroPad16)),
                       .epoch = log.records().epoch(),
                       .is_creation = true};
  store::v1::SessionRecord& state = change.state.emplace();
  state.set_name(change.session);
  state.set_tenant("tenant");
  state.set_create_time_ns(static_cast<int64_t>(number) + 1);
  state.mutable_parameters()->set_dimension(3);
  (*state.mutable_labels())["project"] = "of a length that labels have";
  change.answer.emplace().set_tenant("tenant");
  change.answer->set_request_id(change.session);
  change.answer->set_response(std::string(300, 'x'));
  return change;
}

// `threads` create sessions one after the other, each with an answer.
void MeasureCommits(const std::string& folder, int threads) {
  const auto log = OpenLog(folder);
  constexpr double kSeconds = 3;
  std::vector<std::vector<double>> times(threads);
  std::vector<std::thread> writers;
  const auto start = Clock::now();
  for (int thread = 0; thread < threads; ++thread) {
    writers.emplace_back([&, thread] {
      for (uint64_t i = 0; SecondsSince(start) < kSeconds; ++i) {
        const SessionChange change = MakeCreation(*log, uint64_t{1'000'000} * (thread + 1) + i);
        const auto begun = Clock::now();
        Check(log->Commit(change));
        times[thread].push_back(SecondsSince(begun));
      }
    });
  }
  for (std::thread& writer : writers) {
    writer.join();
  }
  const double seconds = SecondsSince(start);
  std::vector<double> all;
  for (const std::vector<double>& some : times) {
    all.insert(all.end(), some.begin(), some.end());
  }
  std::ranges::sort(all);
  std::printf("creates, %2d threads   %7.0f /s   p50 %6.1f ms   p99 %6.1f ms\n", threads,
              static_cast<double>(all.size()) / seconds, all[all.size() / 2] * 1e3, all[all.size() * 99 / 100] * 1e3);
}

// Messages of 1 MiB, synchronised and committed every 16 MiB, as the service does.
void MeasureUpload(const std::string& folder) {
  const auto log = OpenLog(folder);
  SessionChange change = MakeCreation(*log, 1);
  Check(log->Commit(change));
  const auto points = log->files().OpenPoints({.session = change.session, .dimension = 3});
  const std::vector<double> message(3 * 43'690, 0.5);
  const auto start = Clock::now();
  uint64_t bytes = 0;
  for (int piece = 0; piece < 8; ++piece) {
    for (int i = 0; i < 16; ++i) {
      Check(points->Append(message));
      bytes += message.size() * sizeof(double);
    }
    Check(points->Synchronize());
    change.state->set_points(points->coordinate_count() / 3);
    change.answer.reset();
    change.is_creation = false;
    change.steps.assign(1, {});
    change.steps[0].mutable_points()->set_count(message.size() * 16 / 3);
    Check(log->Commit(change));
  }
  std::printf("upload                %7.0f MB/s, synchronised\n",
              static_cast<double>(bytes) / SecondsSince(start) / 1e6);
}

void MeasureStart(const std::string& folder, uint64_t sessions) {
  {
    const auto log = OpenLog(folder);
    std::atomic<uint64_t> next = 0;
    std::vector<std::thread> writers;
    for (int thread = 0; thread < 64; ++thread) {
      writers.emplace_back([&] {
        for (uint64_t number = next++; number < sessions; number = next++) {
          SessionChange change = MakeCreation(*log, number);
          change.steps.resize(4);
          change.operations.resize(2);
          change.operations[1].set_number(1);
          Check(log->Commit(change));
        }
      });
    }
    for (std::thread& writer : writers) {
      writer.join();
    }
  }
  const auto start = Clock::now();
  const auto log = OpenLog(folder);
  const size_t loaded = Get(log->records().Load()).sessions.size();
  const double seconds = SecondsSince(start);
  Get(log->RemoveGarbage());
  std::printf("start, %zu sessions %7.3f s; with garbage %.3f s; database %.1f MB\n", loaded, seconds,
              SecondsSince(start), static_cast<double>(std::filesystem::file_size(folder + "/sessions.db")) / 1e6);
}

core::Mesh MakeLargeMesh() {
  core::Mesh mesh;
  mesh.dimension = 3;
  mesh.domain_low.assign(3, 0);
  mesh.domain_high.assign(3, 1);
  mesh.points.assign(3 * 160'000, 0.5);
  mesh.simplices.assign(4 * 1'000'000, 7);
  mesh.input_vertex.assign(80'000, 7);
  return mesh;
}

// Seconds for all chunks, through a socket, whose other end is read.
double Download(const MeshSnapshot& mesh) {
  int sockets[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM, 0, sockets) != 0) {
    std::exit(1);
  }
  std::thread reader([&] {
    std::vector<char> bytes(size_t{1} << 20);
    while (::read(sockets[1], bytes.data(), bytes.size()) > 0) {
    }
  });
  const auto start = Clock::now();
  const uint64_t count = Get(mesh.ChunkCount(false));
  for (uint64_t index = 0; index < count; ++index) {
    std::vector<grpc::Slice> slices;
    if (!Get(mesh.SerializeChunk(index, 2, false)).Dump(&slices).ok()) {
      std::exit(1);
    }
    for (const grpc::Slice& slice : slices) {
      for (size_t done = 0; done < slice.size();) {
        const ssize_t written = ::write(sockets[0], slice.begin() + done, slice.size() - done);
        done += written < 0 ? 0 : static_cast<size_t>(written);
      }
    }
  }
  ::shutdown(sockets[0], SHUT_RDWR);
  reader.join();
  const double seconds = SecondsSince(start);
  ::close(sockets[0]);
  ::close(sockets[1]);
  return seconds;
}

void MeasureMesh(const std::string& folder) {
  const auto log = OpenLog(folder);
  const core::Mesh mesh = MakeLargeMesh();
  const double megabytes = static_cast<double>(mesh.points.size() * 8 + mesh.simplices.size() * 4) / 1e6;
  auto start = Clock::now();
  const auto file = Get(log->files().KeepMesh("sessions/1", 1, /*epoch=*/0, mesh, core::RunContext()));
  std::printf("mesh of 10^6 simplices, %.0f MB: kept in %.3f s", megabytes, SecondsSince(start));
  start = Clock::now();
  Get(file->Load(core::RunContext()));
  std::printf(", loaded in %.3f s\n", SecondsSince(start));
  const MemoryMesh memory(1, mesh);
  std::vector<double> ratios;
  double best_file = 1e9;
  double best_memory = 1e9;
  for (int round = 0; round < 21; ++round) {
    const double of_memory = Download(memory);
    const double of_file = Download(*file);
    best_memory = std::min(best_memory, of_memory);
    best_file = std::min(best_file, of_file);
    ratios.push_back(of_memory / of_file);
  }
  std::ranges::sort(ratios);
  std::printf("through a socket: memory %.0f MB/s, file %.0f MB/s; median of the ratios %.2f\n",
              megabytes / best_memory, megabytes / best_file, ratios[ratios.size() / 2]);
}

// A server on the loopback, and a client of it. Empty `folder`: sessions end with it.
struct Service {
  explicit Service(const std::string& folder) {
    ServerOptions options;
    options.listen = "127.0.0.1:0";
    options.service.max_sessions_per_tenant = 1000;
    options.service.max_points = 100'000'000;
    options.service.max_points_per_tenant = 1'000'000'000;
    server = Get(Server::Start(options, std::make_shared<spdlog::logger>("none"),
                               folder.empty() ? nullptr : std::unique_ptr<SessionLog>(OpenLog(folder))));
    channel = grpc::CreateChannel(server->address(), grpc::InsecureChannelCredentials());
    sessions = v1::SessionService::NewStub(channel);
  }

  std::string Create() {
    grpc::ClientContext context;
    v1::CreateSessionRequest request;
    request.mutable_parameters()->set_dimension(3);
    v1::CreateSessionResponse response;
    Check(sessions->CreateSession(&context, request, &response));
    return response.session().name();
  }

  static void Check(const grpc::Status& status) {
    if (!status.ok()) {
      std::fprintf(stderr, "bench_durability: %s\n", status.error_message().c_str());
      std::exit(1);
    }
  }

  std::unique_ptr<Server> server;
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::SessionService::Stub> sessions;
};

// Sends messages of 1 MiB to a session until `stop`, by a connection of its own; goes on where an attempt ends that the
// server gives up, as the client library does. Returns how many it has. `pause`: after each.
uint64_t UploadUntil(const std::atomic<bool>& stop, Service& service, const std::string& name,
                     std::chrono::milliseconds pause) {
  constexpr uint64_t kPoints = 43'690;  // of a message
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto channel =
      grpc::CreateCustomChannel(service.server->address(), grpc::InsecureChannelCredentials(), arguments);
  const auto stub = v1::SessionService::NewStub(channel);
  v1::UploadPointsRequest request;
  request.set_name(name);
  request.mutable_points()->mutable_coordinates()->Resize(3 * kPoints, 0.5);
  uint64_t committed = 0;
  while (!stop) {
    grpc::ClientContext context;
    v1::UploadPointsResponse response;
    const auto stream = stub->UploadPoints(&context, &response);
    request.set_point_offset(committed);
    while (!stop && stream->Write(request)) {
      request.set_point_offset(request.point_offset() + kPoints);
      std::this_thread::sleep_for(pause);
    }
    stream->WritesDone();
    (void)stream->Finish();
    grpc::ClientContext get_context;
    v1::GetSessionRequest get;
    get.set_name(name);
    v1::GetSessionResponse got;
    Service::Check(stub->GetSession(&get_context, get, &got));
    committed = got.session().committed_points();
  }
  return committed / kPoints;
}

// GetSession of one client, one after the other, beside `uploads`, which pause after each message.
void MeasureGets(const std::string& folder, int uploads, std::chrono::milliseconds pause) {
  constexpr double kSeconds = 10;
  Service service(folder);
  const std::string asked = service.Create();
  std::atomic<bool> stop = false;
  std::atomic<uint64_t> megabytes = 0;
  std::vector<std::string> names;
  for (int i = 0; i < uploads; ++i) {
    names.push_back(service.Create());
  }
  std::vector<std::thread> uploaders;
  for (int i = 0; i < uploads; ++i) {
    uploaders.emplace_back([&, i, name = names[i]] {
      std::this_thread::sleep_for(pause * i / uploads);  // not all at the same moment
      megabytes += UploadUntil(stop, service, name, pause);
    });
  }
  std::vector<double> times;
  const auto start = Clock::now();
  while (SecondsSince(start) < kSeconds) {
    grpc::ClientContext context;
    v1::GetSessionRequest request;
    request.set_name(asked);
    v1::GetSessionResponse response;
    const auto begun = Clock::now();
    Service::Check(service.sessions->GetSession(&context, request, &response));
    times.push_back(SecondsSince(begun));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  stop = true;
  for (std::thread& uploader : uploaders) {
    uploader.join();
  }
  const double seconds = SecondsSince(start);
  std::ranges::sort(times);
  std::printf("GetSession, %3d uploads p50 %6.2f ms   p99 %6.2f ms   of %zu; uploads %.0f MB/s\n", uploads,
              times[times.size() / 2] * 1e3, times[times.size() * 99 / 100] * 1e3, times.size(),
              static_cast<double>(megabytes) * 1.048576 / seconds);
}

// A session with a mesh of about 10^6 simplices.
std::string MakeMeshedSession(Service& service) {
  const std::string name = service.Create();
  {
    grpc::ClientContext context;
    v1::UploadPointsResponse response;
    const auto stream = service.sessions->UploadPoints(&context, &response);
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    v1::UploadPointsRequest request;
    request.set_name(name);
    for (int point = 0; point < 60'000; point += 20'000) {
      request.set_point_offset(point);
      request.mutable_points()->clear_coordinates();
      for (int i = 0; i < 3 * 20'000; ++i) {
        request.mutable_points()->add_coordinates(uniform(random));
      }
      stream->Write(request);
    }
    stream->WritesDone();
    Service::Check(stream->Finish());
  }
  const auto operations = v1::OperationService::NewStub(service.channel);
  grpc::ClientContext context;
  v1::StartRefinementRequest start;
  start.set_name(name);
  v1::StartRefinementResponse started;
  Service::Check(operations->StartRefinement(&context, start, &started));
  v1::GetOperationRequest get;
  get.set_name(started.operation().name());
  v1::GetOperationResponse got;
  while (got.operation().state() != v1::Operation::STATE_SUCCEEDED) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    grpc::ClientContext get_context;
    Service::Check(operations->GetOperation(&get_context, get, &got));
  }
  return name;
}

// MB/s of a download over gRPC, by a client that takes the messages apart.
double DownloadRate(Service& service, const std::string& name) {
  grpc::ClientContext context;
  v1::DownloadMeshRequest request;
  request.set_name(name);
  const auto start = Clock::now();
  const auto stream = service.sessions->DownloadMesh(&context, request);
  v1::DownloadMeshResponse response;
  uint64_t bytes = 0;
  while (stream->Read(&response)) {
    bytes += response.ByteSizeLong();
  }
  Service::Check(stream->Finish());
  return static_cast<double>(bytes) / SecondsSince(start) / 1e6;
}

// From a file and from memory, one after the other.
void MeasureDownloads(const std::string& folder) {
  Service durable(folder);
  Service ephemeral("");
  const std::string in_file = MakeMeshedSession(durable);
  const std::string in_memory = MakeMeshedSession(ephemeral);
  std::vector<double> file;
  std::vector<double> memory;
  std::vector<double> ratios;
  for (int round = 0; round < 31; ++round) {
    memory.push_back(DownloadRate(ephemeral, in_memory));
    file.push_back(DownloadRate(durable, in_file));
    ratios.push_back(file.back() / memory.back());
  }
  for (std::vector<double>* const rates : {&memory, &file, &ratios}) {
    std::ranges::sort(*rates);
  }
  std::printf("over gRPC: memory %.0f MB/s, file %.0f MB/s at best, %.0f and %.0f in the median; ratio %.2f, %.2f\n",
              memory.back(), file.back(), memory[15], file[15], file.back() / memory.back(), ratios[15]);
}

}  // namespace
}  // namespace wellspace::server

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: bench_durability FOLDER\n");
    return 2;
  }
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const std::string root = std::string(argv[1]) + "/bench_durability";
  const auto fresh = [&](const char* name) {
    std::filesystem::remove_all(root);
    return root + "/" + name;
  };
  for (const int threads : {1, 4, 16, 64}) {
    wellspace::server::MeasureCommits(fresh("commits"), threads);
  }
  wellspace::server::MeasureUpload(fresh("upload"));
  wellspace::server::MeasureStart(fresh("start"), 10'000);
  wellspace::server::MeasureMesh(fresh("mesh"));
  wellspace::server::MeasureDownloads(fresh("downloads"));
  using std::chrono::milliseconds;
  wellspace::server::MeasureGets(fresh("gets"), 0, milliseconds(0));
  wellspace::server::MeasureGets(fresh("gets"), 100, milliseconds(1000));
  wellspace::server::MeasureGets(fresh("gets"), 100, milliseconds(0));
  std::filesystem::remove_all(root);
  return 0;
}
