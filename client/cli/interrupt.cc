#include "client/cli/interrupt.h"

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>

#include "client/cli/exit_codes.h"

namespace wellspace::cli {

Interrupt::Interrupt() {
  sigset_t taken;
  sigemptyset(&taken);
  sigaddset(&taken, SIGINT);
  sigaddset(&taken, SIGTERM);
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
      if (signal_.load() != 0) {
        _exit(kExitSignal + static_cast<int>(info.ssi_signo));
      }
      signal_.store(static_cast<int>(info.ssi_signo));
      stop_.request_stop();
    }
    if (descriptors[1].revents != 0) {
      return;
    }
  }
}

}  // namespace wellspace::cli
