// The metrics of a server, for Prometheus.
#ifndef WELLSPACE_SERVER_OBSERVABILITY_METRICS_H_
#define WELLSPACE_SERVER_OBSERVABILITY_METRICS_H_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "prometheus/collectable.h"
#include "prometheus/registry.h"

namespace wellspace::server {

// The metrics of one server: some are counted where they happen, others are read when Prometheus asks.
//
// Thread safety: thread-safe, once all have been added.
class Metrics {
 public:
  using Read = std::function<double()>;

  // Has the process's own (process_*) and wellspace_build_info already.
  Metrics();
  ~Metrics();

  // For families that are counted.
  prometheus::Registry& registry() { return *registry_; }

  // A number that is read at every scrape, by a thread of its own; a counter never falls. REQUIRES: `read` can be
  // called as long as an endpoint serves this.
  void AddGauge(std::string name, std::string help, Read read);
  void AddCounter(std::string name, std::string help, Read read);

  // All that is to be served.
  std::vector<std::shared_ptr<prometheus::Collectable>> Collectables() const;

 private:
  class ReadFamilies;

  const std::shared_ptr<prometheus::Registry> registry_;
  const std::shared_ptr<ReadFamilies> read_families_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OBSERVABILITY_METRICS_H_
