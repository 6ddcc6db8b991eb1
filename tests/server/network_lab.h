// Machines in a network of the test's own, between any two of which the way can be cut, in one direction or in both.
#ifndef WELLSPACE_TESTS_SERVER_NETWORK_LAB_H_
#define WELLSPACE_TESTS_SERVER_NETWORK_LAB_H_

#include <string>
#include <vector>

#include "tests/server/store/store_support.h"

namespace wellspace::server {

// Network namespaces around a router, which is one, too; the test itself has a way to each. What is cut is dropped by
// the router without a word, as by a broken cable. Needs no more than iproute2 and root.
//
// All of them are gone with this. Their names have the number of this process: those of a test that was killed go when
// the next one begins. What runs on a machine ends with the thread that has started it.
//
// Thread safety: thread-compatible.
class NetworkLab {
 public:
  struct Machine {
    std::string name;
    std::string address;              // of IPv4
    std::vector<std::string> before;  // a command that runs what stands behind it there: see Subprocess
  };

  // Why there can be none; empty: there can.
  static std::string WhyNot();

  // REQUIRES:   WhyNot() is empty.
  NetworkLab();
  ~NetworkLab();
  NetworkLab(const NetworkLab&) = delete;
  NetworkLab& operator=(const NetworkLab&) = delete;

  // `name`: of letters and digits.
  Machine AddMachine(const std::string& name);

  // From now on nothing comes from one to the other; what comes back does.
  void Cut(const Machine& from, const Machine& to);
  // Until this.
  void HealAll();

 private:
  // By a shell; its error is a failure of the test.
  void Run(const std::string& commands) const;
  std::string Named(const std::string& name) const;
  static void RemoveAbandoned();

  const TestFolder folder_;
  int network_ = 0;  // 10.network_.0.0/16
  int machines_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_NETWORK_LAB_H_
