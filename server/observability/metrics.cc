#include "server/observability/metrics.h"

#include <utility>

#include "prometheus/gauge.h"
#include "server/base/version.h"
#include "server/observability/process_metrics.h"

namespace wellspace::server {

class Metrics::ReadFamilies final : public prometheus::Collectable {
 public:
  void Add(prometheus::MetricType type, std::string name, std::string help, Read read) {
    families_.push_back({type, std::move(name), std::move(help), std::move(read)});
  }

  std::vector<prometheus::MetricFamily> Collect() const override {
    std::vector<prometheus::MetricFamily> collected;
    for (const Family& family : families_) {
      prometheus::ClientMetric metric;
      (family.type == prometheus::MetricType::Counter ? metric.counter.value : metric.gauge.value) = family.read();
      collected.push_back({family.name, family.help, family.type, {std::move(metric)}});
    }
    return collected;
  }

 private:
  struct Family {
    prometheus::MetricType type;
    std::string name;
    std::string help;
    Read read;
  };

  std::vector<Family> families_;
};

Metrics::Metrics()
    : registry_(std::make_shared<prometheus::Registry>()), read_families_(std::make_shared<ReadFamilies>()) {
  prometheus::BuildGauge()
      .Name("wellspace_build_info")
      .Help("1, labelled with the version of wellspaced.")
      .Register(*registry_)
      .Add({{"version", kVersion}})
      .Set(1);
  AddProcessMetrics(*this);
}

Metrics::~Metrics() = default;

void Metrics::AddGauge(std::string name, std::string help, Read read) {
  read_families_->Add(prometheus::MetricType::Gauge, std::move(name), std::move(help), std::move(read));
}

void Metrics::AddCounter(std::string name, std::string help, Read read) {
  read_families_->Add(prometheus::MetricType::Counter, std::move(name), std::move(help), std::move(read));
}

std::vector<std::shared_ptr<prometheus::Collectable>> Metrics::Collectables() const {
  return {registry_, read_families_};
}

}  // namespace wellspace::server
