// Signals that end the program, without unfinished files left behind.
#ifndef WELLSPACE_CLIENT_CLI_INTERRUPT_H_
#define WELLSPACE_CLIENT_CLI_INTERRUPT_H_

#include <atomic>
#include <csignal>
#include <stop_token>
#include <thread>

namespace wellspace::cli {

// While it lives, the first SIGINT, SIGTERM or SIGHUP requests a stop instead of ending the process; the second one
// ends it, and so does the first SIGQUIT or SIGXCPU. Temporary files (see formats::OutputFile) go before. SIGHUP stays
// ignored where it is: nohup(1).
//
// Signals are blocked and taken from a signalfd, so that no handler runs: threads started after it inherit the mask.
// REQUIRES:   only the calling thread runs, or the others block these signals too. Thread safety: thread-safe.
class Interrupt {
 public:
  // kEnd: the first signal, whichever it is, ends the process: for work that does not look at a stop token.
  enum class First { kStop, kEnd };

  // While it lives, the first signal ends the process: beside work that looks at the stop token, files are read, which
  // does not.
  class AtOnce {
   public:
    explicit AtOnce(const Interrupt& interrupt)
        : interrupt_(interrupt), before_(interrupt.first_.exchange(First::kEnd)) {}
    ~AtOnce() { interrupt_.first_ = before_; }
    AtOnce(const AtOnce&) = delete;
    AtOnce& operator=(const AtOnce&) = delete;

   private:
    const Interrupt& interrupt_;
    const First before_;
  };

  explicit Interrupt(First first = First::kStop);
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  std::stop_token token() const { return stop_.get_token(); }
  // The signal that came, or 0.
  int signal() const { return signal_.load(); }

 private:
  void Wait();
  // Ends the process as `signal` does by default.
  [[noreturn]] static void End(int signal);

  mutable std::atomic<First> first_;
  sigset_t previous_mask_;
  int signals_;  // signalfd
  int end_;      // eventfd
  std::atomic<int> signal_{0};
  std::stop_source stop_;
  std::thread thread_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_INTERRUPT_H_
