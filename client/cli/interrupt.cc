#include "client/cli/interrupt.h"

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>

#include "client/cli/exit_codes.h"
#include "client/formats/io/output_file.h"

namespace wellspace::cli {
namespace {

bool IsIgnored(int signal) {
  struct sigaction action;
  return sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

// Whether work may end in its own way when the signal comes.
bool MayStop(int signal) { return signal == SIGINT || signal == SIGTERM || signal == SIGHUP; }

}  // namespace

Interrupt::Interrupt(First first) : first_(first) {
  sigset_t taken;
  sigemptyset(&taken);
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT, SIGXCPU}) {
    sigaddset(&taken, signal);
  }
  if (!IsIgnored(SIGHUP)) {
    sigaddset(&taken, SIGHUP);
  }
  pthread_sigmask(SIG_BLOCK, &taken, &previous_mask_);
  signals_ = signalfd(-1, &taken, SFD_CLOEXEC);
  end_ = eventfd(0, EFD_CLOEXEC);
  if (signals_ < 0 || end_ < 0) {
    std::abort();  // no descriptors at the very start of the program
  }
  thread_ = std::thread([this] { Wait(); });
}

Interrupt::~Interrupt() {
  const uint64_t one = 1;
  if (write(end_, &one, sizeof(one)) != sizeof(one)) {
    std::abort();  // an eventfd takes a 1
  }
  thread_.join();
  close(signals_);
  close(end_);
  pthread_sigmask(SIG_SETMASK, &previous_mask_, nullptr);
}

void Interrupt::Wait() {
  pollfd descriptors[] = {{.fd = signals_, .events = POLLIN, .revents = 0},
                          {.fd = end_, .events = POLLIN, .revents = 0}};
  while (true) {
    if (poll(descriptors, 2, -1) < 0) {
      continue;  // EINTR
    }
    signalfd_siginfo info;
    if (descriptors[0].revents != 0 && read(signals_, &info, sizeof(info)) == sizeof(info)) {
      const int signal = static_cast<int>(info.ssi_signo);
      if (first_ == First::kEnd || !MayStop(signal)) {
        End(signal);
      }
      if (signal_.load() != 0) {
        formats::RemoveTemporaryFilesForGood();
        _exit(kExitSignal + signal);
      }
      signal_.store(signal);
      stop_.request_stop();
    }
    if (descriptors[1].revents != 0) {
      return;
    }
  }
}

void Interrupt::End(int signal) {
  formats::RemoveTemporaryFilesForGood();
  std::signal(signal, SIG_DFL);
  sigset_t only;
  sigemptyset(&only);
  sigaddset(&only, signal);
  pthread_sigmask(SIG_UNBLOCK, &only, nullptr);
  raise(signal);
  _exit(kExitSignal + signal);
}

}  // namespace wellspace::cli
