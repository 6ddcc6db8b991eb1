#include "tests/server/network_lab.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "tests/server/subprocess.h"

namespace wellspace::server {
namespace {

namespace fs = std::filesystem;

constexpr char kNamespaces[] = "/run/netns";
constexpr char kPrefix[] = "wellspace-";
constexpr char kRouter[] = "router";
// Of the networks 10.N.0.0/16, the first that is asked for, and how many.
constexpr int kFirstNetwork = 64;
constexpr int kNetworks = 128;

// Its exit code. What it says goes to `error_path`.
int Shell(const std::string& commands, const std::string& error_path) {
  return Subprocess("/bin/sh", {"-ec", "PATH=$PATH:/usr/sbin:/sbin; " + commands}, error_path).Wait();
}

}  // namespace

std::string NetworkLab::WhyNot() {
  if (geteuid() != 0) {
    return "network namespaces are made by root alone";
  }
  const TestFolder folder;
  const std::string said = folder.path() + "/said";
  const std::string probe = absl::StrCat(kPrefix, getpid(), "-probe");
  if (Shell("command -v ip nsenter setpriv", said) != 0) {
    return "there is no iproute2 (deploy/install-deps.sh test)";
  }
  // A container's root may have no CAP_NET_ADMIN, or no /proc/sys to write to, and a kernel no rules.
  const int code =
      Shell(absl::StrCat("ip netns add ", probe, "; trap 'ip netns del ", probe, "' EXIT; nsenter --net=", kNamespaces,
                         "/", probe, " sh -c 'echo 1 > /proc/sys/net/ipv4/ip_forward'; ", "ip link add name ws",
                         getpid(), "p type veth peer name probe netns ", probe, "; ip -n ", probe,
                         " rule add from 10.0.0.1 to 10.0.0.2 blackhole"),
            said);
  return code == 0 ? ""
                   : "this process may make no network namespaces: it has no CAP_NET_ADMIN, or may not "
                     "have them forward, or the kernel has none";
}

NetworkLab::NetworkLab() {
  RemoveAbandoned();
  for (int i = 0; i < kNetworks && network_ == 0; ++i) {
    const int network = kFirstNetwork + (getpid() + i) % kNetworks;
    const std::string is_free =
        absl::StrCat("test -z \"$(ip -4 route list root 10.", network, ".0.0/16; ip -4 route list match 10.", network,
                     ".0.0/16 | grep -v ^default)\"");
    network_ = Shell(is_free, folder_.path() + "/said") == 0 ? network : 0;
  }
  EXPECT_NE(network_, 0) << "no network 10.N.0.0/16 is free";
  const std::string router = Named(kRouter);
  const std::string device = absl::StrCat("ws", getpid());
  Run(absl::StrCat("ip netns add ", router, "; ip -n ", router, " link set lo up; nsenter --net=", kNamespaces, "/",
                   router, " sh -c 'echo 1 > /proc/sys/net/ipv4/ip_forward'; ip link add name ", device,
                   " type veth peer name test netns ", router, "; ip addr add 10.", network_, ".0.2/30 dev ", device,
                   "; ip link set ", device, " up; ip -n ", router, " addr add 10.", network_,
                   ".0.1/30 dev test; ip -n ", router, " link set test up; ip route add 10.", network_,
                   ".0.0/16 via 10.", network_, ".0.1"));
}

NetworkLab::~NetworkLab() {
  // The other ends of their cables go with them.
  Run(absl::StrCat("for name in $(ip netns list | cut -d ' ' -f 1 | grep '^", Named(""),
                   "'); do ip netns del $name; done"));
}

NetworkLab::Machine NetworkLab::AddMachine(const std::string& name) {
  const int number = ++machines_;
  const std::string router = Named(kRouter);
  const std::string machine = Named(name);
  const std::string network = absl::StrCat("10.", network_, ".", number);
  Run(absl::StrCat("ip netns add ", machine, "; ip -n ", machine, " link set lo up; ip -n ", router, " link add name ",
                   name, " type veth peer name eth0 netns ", machine, "; ip -n ", router, " addr add ", network,
                   ".1/30 dev ", name, "; ip -n ", router, " link set ", name, " up; ip -n ", machine, " addr add ",
                   network, ".2/30 dev eth0; ip -n ", machine, " link set eth0 up; ip -n ", machine,
                   " route add default via ", network, ".1"));
  return {.name = name,
          .address = network + ".2",
          .before = {"/usr/bin/nsenter", absl::StrCat("--net=", kNamespaces, "/", machine), "/usr/bin/setpriv",
                     "--pdeathsig", "KILL"}};
}

void NetworkLab::Cut(const Machine& from, const Machine& to) {
  Run(absl::StrCat("ip -n ", Named(kRouter), " rule add from ", from.address, " to ", to.address,
                   " blackhole priority 10"));
}

void NetworkLab::HealAll() {
  Run(absl::StrCat("while ip -n ", Named(kRouter), " rule del priority 10 2>/dev/null; do :; done"));
}

void NetworkLab::Run(const std::string& commands) const {
  const std::string said = folder_.path() + "/said";
  const int code = Shell(commands, said);
  EXPECT_EQ(code, 0) << commands << "; see " << said;
}

std::string NetworkLab::Named(const std::string& name) const { return absl::StrCat(kPrefix, getpid(), "-", name); }

void NetworkLab::RemoveAbandoned() {
  const TestFolder folder;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(kNamespaces, error)) {
    const std::string name = entry.path().filename();
    const std::string rest = name.starts_with(kPrefix) ? name.substr(sizeof(kPrefix) - 1) : "";
    int pid = 0;
    if (absl::SimpleAtoi(rest.substr(0, rest.find('-')), &pid) && !fs::exists(absl::StrCat("/proc/", pid))) {
      Shell("ip netns del " + name, folder.path() + "/said");
    }
  }
}

}  // namespace wellspace::server
