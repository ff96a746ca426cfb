// A fixed set of threads for work that is the same whoever does it.
#pragma once

#include <functional>
#include <memory>

namespace traceur {

/// Life of a pool:
///   1. The constructor starts threads-1 workers; the caller's thread is the last one.
///   2. forEach(n, work) calls work(i) once for each i in [0, n), in any order and on any thread,
///      and returns when all are done. An exception is rethrown after the others have finished;
///      of several, the one of the smallest i, so that the message does not depend on timing.
///   3. The destructor joins the workers.
/// forEach is not reentrant and is called from one thread at a time.
class ThreadPool {
 public:
  /// @param threads  at least 1; 0 means one for each processor
  explicit ThreadPool(int threads = 0);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const;
  void forEach(int n, const std::function<void(int)>& work);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace traceur
