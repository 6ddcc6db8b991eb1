#include "tests/server/raw_http2.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

constexpr size_t kFrameHeaderBytes = 9;
constexpr int kPatienceSeconds = 60;

uint32_t ReadBigEndian(std::string_view bytes) {
  uint32_t value = 0;
  for (const char byte : bytes) {
    value = value << 8 | static_cast<uint8_t>(byte);
  }
  return value;
}

// The size that `settings` give to the windows of streams.
std::optional<uint32_t> InitialWindowOf(const Frame& settings) {
  constexpr uint32_t kInitialWindowSize = 4;
  constexpr size_t kSettingBytes = 6;
  const std::string_view bytes = settings.payload;
  std::optional<uint32_t> size;
  for (size_t i = 0; i + kSettingBytes <= bytes.size(); i += kSettingBytes) {
    if (ReadBigEndian(bytes.substr(i, 2)) == kInitialWindowSize) {
      size = ReadBigEndian(bytes.substr(i + 2, 4));
    }
  }
  return size;
}

// A string of HPACK, without Huffman's code: its length with a prefix of seven bits.
std::string HpackString(std::string_view text) {
  constexpr size_t kPrefix = 127;
  std::string bytes;
  if (text.size() < kPrefix) {
    bytes.push_back(static_cast<char>(text.size()));
  } else {
    const size_t rest = text.size() - kPrefix;
    bytes.push_back(static_cast<char>(kPrefix));
    bytes.push_back(static_cast<char>(0x80 | (rest & 0x7f)));
    bytes.push_back(static_cast<char>(rest >> 7));
  }
  return bytes.append(text);
}

}  // namespace

std::string Frame::Serialize() const {
  std::string bytes = BigEndian(static_cast<uint32_t>(payload.size())).substr(1);
  bytes.push_back(static_cast<char>(type));
  bytes.push_back(static_cast<char>(flags));
  return bytes + BigEndian(stream) + payload;
}

std::string BigEndian(uint32_t value) {
  std::string bytes;
  for (const int shift : {24, 16, 8, 0}) {
    bytes.push_back(static_cast<char>(value >> shift));
  }
  return bytes;
}

std::string ConnectionStart() {
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + Frame{.type = Frame::kSettings}.Serialize();
}

std::string Header(std::string_view name, std::string_view value) {
  return absl::StrCat(std::string(1, '\0'), HpackString(name), HpackString(value));
}

std::string CallHeaders(std::string_view path) {
  return Header(":method", "POST") + Header(":scheme", "http") + Header(":path", path) +
         Header(":authority", "localhost") + Header("te", "trailers") + Header("content-type", "application/grpc");
}

Frame BeginCall(uint32_t stream, std::string_view path) {
  return {.type = Frame::kHeaders, .flags = Frame::kEndHeaders, .stream = stream, .payload = CallHeaders(path)};
}

Frame ResetCall(uint32_t stream) {
  constexpr uint32_t kCancel = 8;
  return {.type = Frame::kRstStream, .stream = stream, .payload = BigEndian(kCancel)};
}

std::string GrpcMessage(std::string_view bytes, std::optional<uint32_t> length, uint8_t flag) {
  return absl::StrCat(std::string(1, static_cast<char>(flag)), BigEndian(length.value_or(bytes.size())),
                      std::string(bytes));
}

RawConnection::RawConnection(const std::string& address) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const size_t colon = address.rfind(':');
  int port = 0;
  EXPECT_TRUE(absl::SimpleAtoi(address.substr(colon + 1), &port)) << address;
  sockaddr_in server = {};
  server.sin_family = AF_INET;
  server.sin_port = htons(static_cast<uint16_t>(port));
  EXPECT_EQ(inet_pton(AF_INET, address.substr(0, colon).c_str(), &server.sin_addr), 1) << address;
  SetPatience(kPatienceSeconds);
  EXPECT_EQ(connect(socket_, reinterpret_cast<const sockaddr*>(&server), sizeof(server)), 0) << address;
}

void RawConnection::SetPatience(int seconds) {
  const timeval patience = {.tv_sec = seconds, .tv_usec = 0};
  setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
}

RawConnection::~RawConnection() {
  if (socket_ >= 0) {
    close(socket_);
  }
}

RawConnection::RawConnection(RawConnection&& other) noexcept : socket_(std::exchange(other.socket_, -1)) {}

bool RawConnection::Send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) {
      is_stuck_ = sent < 0 && errno == EAGAIN;
      return false;
    }
    bytes.remove_prefix(sent);
  }
  return true;
}

bool RawConnection::Begin() {
  return Send(ConnectionStart()) && ReadUntil(Frame::kSettings).has_value() &&
         Send(Frame{.type = Frame::kSettings, .flags = Frame::kAck});
}

void RawConnection::Discard() {
  while (recv(socket_, nullptr, size_t{1} << 20, MSG_TRUNC | MSG_DONTWAIT) > 0) {
  }
}

std::string RawConnection::ReadBytes(size_t size) {
  std::string bytes(size, '\0');
  size_t taken = 0;
  while (taken < size) {
    const ssize_t got = recv(socket_, bytes.data() + taken, size - taken, 0);
    if (got <= 0) {
      break;
    }
    taken += got;
  }
  bytes.resize(taken);
  return bytes;
}

std::optional<Frame> RawConnection::Read() {
  const std::string header = ReadBytes(kFrameHeaderBytes);
  if (header.size() < kFrameHeaderBytes) {
    return std::nullopt;
  }
  const std::string_view view = header;
  const size_t length = ReadBigEndian(view.substr(0, 3));
  Frame frame = {.type = static_cast<uint8_t>(view[3]),
                 .flags = static_cast<uint8_t>(view[4]),
                 .stream = ReadBigEndian(view.substr(5)),
                 .payload = ReadBytes(length)};
  return frame.payload.size() == length ? std::optional(std::move(frame)) : std::nullopt;
}

std::optional<Frame> RawConnection::ReadUntil(uint8_t type) {
  std::optional<Frame> frame = Read();
  while (frame.has_value() && frame->type != type) {
    frame = Read();
  }
  return frame;
}

uint64_t RawConnection::SendMessageUntilRefused(std::string_view path, uint32_t length) {
  constexpr uint32_t kStream = 1;
  constexpr size_t kPiece = 16384;
  constexpr uint32_t kInitialWindow = 65535;
  const std::string start = GrpcMessage("", length);
  Send(ConnectionStart() + BeginCall(kStream, path).Serialize() +
       Frame{.type = Frame::kData, .stream = kStream, .payload = start}.Serialize());
  const std::string piece =
      Frame{.type = Frame::kData, .stream = kStream, .payload = std::string(kPiece, 'x')}.Serialize();
  int64_t initial = kInitialWindow;
  int64_t of_connection = kInitialWindow - static_cast<int64_t>(start.size());
  int64_t of_stream = of_connection;
  uint64_t sent = 0;
  while (sent < length) {
    if (std::min(of_connection, of_stream) >= static_cast<int64_t>(kPiece)) {
      if (!Send(piece)) {
        return sent;
      }
      of_connection -= kPiece;
      of_stream -= kPiece;
      sent += kPiece;
      continue;
    }
    const std::optional<Frame> frame = Read();
    if (!frame.has_value() || (frame->stream == kStream && frame->type != Frame::kWindowUpdate)) {
      return sent;  // closed, or the headers or the reset with which the call ends
    }
    if (frame->type == Frame::kWindowUpdate) {
      (frame->stream == 0 ? of_connection : of_stream) += ReadBigEndian(frame->payload);
    } else if (frame->type == Frame::kPing && frame->flags != Frame::kAck) {
      Send(Frame{.type = Frame::kPing, .flags = Frame::kAck, .payload = frame->payload});
    } else if (frame->type == Frame::kSettings && frame->flags != Frame::kAck) {
      const int64_t before = initial;
      initial = InitialWindowOf(*frame).value_or(initial);
      of_stream += initial - before;
      Send(Frame{.type = Frame::kSettings, .flags = Frame::kAck});
    }
  }
  return sent;
}

bool RawConnection::IsClosedByServer() {
  char buffer[4096];
  ssize_t got = 1;
  while (got > 0) {
    got = recv(socket_, buffer, sizeof(buffer), 0);
  }
  return got == 0 || errno == ECONNRESET;
}

bool RawConnection::IsAlive() {
  const std::string payload = "are you?";
  Send(Frame{.type = Frame::kPing, .payload = payload});
  std::optional<Frame> frame = ReadUntil(Frame::kPing);
  while (frame.has_value() && !(frame->flags == Frame::kAck && frame->payload == payload)) {
    frame = ReadUntil(Frame::kPing);
  }
  return frame.has_value();
}

int RawConnection::ReadStatus(uint32_t stream) {
  constexpr std::string_view kName = "grpc-status";
  while (const std::optional<Frame> frame = Read()) {
    if (frame->stream != stream) {
      continue;
    }
    const size_t name = frame->type == Frame::kHeaders ? frame->payload.find(kName) : std::string::npos;
    int status = -1;
    if (name != std::string::npos) {
      const std::string value = frame->payload.substr(name + kName.size());
      EXPECT_TRUE(absl::SimpleAtoi(value.substr(1, static_cast<uint8_t>(value[0])), &status));
      return status;
    }
    if (frame->type == Frame::kRstStream) {
      return -1;
    }
  }
  return -1;
}

}  // namespace wellspace::server
