// Page tokens: the place where the next page of a list begins.
#ifndef WELLSPACE_SERVER_SERVICES_PAGE_TOKEN_H_
#define WELLSPACE_SERVER_SERVICES_PAGE_TOKEN_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "google/protobuf/repeated_field.h"
#include "server/base/options.h"

namespace wellspace::server {

// The most that a page has: items, and bytes of them unless a single one has more.
inline constexpr int kMaxPageSize = 1000;
inline constexpr size_t kMaxPageBytes = size_t{kMaxResponseBytes} / 2;

// A token for `position`, any bytes, in the list of which `list` is everything that it depends on.
std::string MakePageToken(const std::string& list, const std::string& position);

// The position of a token of the same list; nothing if it was not made for that.
std::optional<std::string> ReadPageToken(const std::string& list, const std::string& token);

// A number as a position, and back; nothing if it is none.
std::string PositionOf(uint64_t number);
std::optional<uint64_t> NumberAt(const std::string& position);

// Appends Item::Describe() of the first of `items` to `page`, at most `count` and kMaxPageBytes; returns how many.
template <typename Item, typename Message>
size_t FillPage(const std::vector<std::shared_ptr<Item>>& items, size_t count,
                google::protobuf::RepeatedPtrField<Message>* page) {
  size_t filled = 0;
  for (size_t bytes = 0; filled < items.size() && filled < count; ++filled) {
    Message message = items[filled]->Describe();
    bytes += message.ByteSizeLong();
    if (bytes > kMaxPageBytes && filled > 0) {
      break;
    }
    *page->Add() = std::move(message);
  }
  return filled;
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_PAGE_TOKEN_H_
