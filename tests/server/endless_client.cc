// endless_client HOST:PORT: has a large cloud meshed, prints "running" with the first progress of the refinement, and
// reads on. A client to be killed.
#include <iostream>
#include <random>
#include <vector>

#include "client/client.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: endless_client HOST:PORT" << std::endl;
    return 2;
  }
  absl::StatusOr<wellspace::client::Client> client = wellspace::client::Connect(argv[1]);
  if (!client.ok()) {
    std::cerr << client.status() << std::endl;
    return 1;
  }
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> points(3 * 100'000);
  for (double& coordinate : points) {
    coordinate = uniform(generator);
  }
  bool running = false;
  const auto mesh = client->MeshPoints({}, points, [&running](const wellspace::client::Progress& progress) {
    if (progress.phase == "refinement" && !running) {
      running = true;
      std::cout << "running" << std::endl;
    }
  });
  std::cout << mesh.status() << std::endl;
  return mesh.ok() ? 0 : 1;
}
