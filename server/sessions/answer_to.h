// The record of the answer to a request, which the log keeps with the change that the request asks for.
#ifndef WELLSPACE_SERVER_SESSIONS_ANSWER_TO_H_
#define WELLSPACE_SERVER_SESSIONS_ANSWER_TO_H_

#include <functional>
#include <optional>

#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// Makes the record of the answer to the request for a change; the argument is the answer itself. It is called once the
// change is certain to be made, unless the log cannot write it down.
template <typename T>
using AnswerTo = std::function<std::optional<store::v1::AnswerRecord>(const T&)>;

// Nothing where `answer` is null.
template <typename T>
std::optional<store::v1::AnswerRecord> AnswerRecordOf(const AnswerTo<T>& answer, const T& with) {
  return answer == nullptr ? std::nullopt : answer(with);
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_ANSWER_TO_H_
