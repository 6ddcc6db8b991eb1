// What is written down as the answer to a request with a change that it asks for.
#ifndef WELLSPACE_SERVER_SESSIONS_ANSWER_TO_H_
#define WELLSPACE_SERVER_SESSIONS_ANSWER_TO_H_

#include <functional>
#include <optional>

#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// What is written down as the answer to the request that a change is made for, given what it is answered with. It is
// called once the change is certain to be made, unless it cannot be written down.
template <typename T>
using AnswerTo = std::function<std::optional<store::v1::AnswerRecord>(const T&)>;

// Nothing where `answer` is null.
template <typename T>
std::optional<store::v1::AnswerRecord> AnswerRecordOf(const AnswerTo<T>& answer, const T& with) {
  return answer == nullptr ? std::nullopt : answer(with);
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_ANSWER_TO_H_
