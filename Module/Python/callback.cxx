// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The module teravox._callback: volumes whose bricks are read by Python code.
//
// Bricks are read by threads of the C++ part, which take the interpreter's lock for the time of a
// call. The thread that renders holds that lock, and waits for those bricks: it gives the lock up
// while it waits (vtkCallbackVolumeSource::SetWaitFunctions).
#include "vtkCallbackVolumeSource.h"
#include "vtkPython.h" // first: Python wants to set feature macros
#include "vtkPythonUtil.h"

#include <algorithm>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace
{

/// Counts the calls under way, and lets none begin once the interpreter is about to end: a thread
/// that asks for its lock then never comes back.
class Gate
{
public:
  bool IsClosed()
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    return this->Closed;
  }
  bool Enter()
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Inside += this->Closed ? 0 : 1;
    return !this->Closed;
  }
  void Leave()
  {
    {
      const std::lock_guard<std::mutex> lock(this->Mutex);
      --this->Inside;
    }
    this->Changed.notify_all();
  }
  void CloseAndWait()
  {
    std::unique_lock<std::mutex> lock(this->Mutex);
    this->Closed = true;
    this->Changed.wait(lock, [this] { return this->Inside == 0; });
  }

private:
  std::mutex Mutex;
  std::condition_variable Changed;
  int Inside = 0;
  bool Closed = false;
};

// Never destroyed, as the one below: threads may outlive the interpreter.
Gate& TheGate()
{
  static Gate* const gate = new Gate;
  return *gate;
}

/// Objects to let go of. Readers die on any thread and under locks of the C++ part, where one must
/// not wait for the interpreter; so their objects are let go of by the next one who has its lock.
class Released
{
public:
  void Add(PyObject* object)
  {
    if (TheGate().IsClosed())
    {
      return; // the interpreter ends, and its objects with it
    }
    {
      const std::lock_guard<std::mutex> lock(this->Mutex);
      this->Objects.push_back(object);
    }
    // Where its queue is full, the next call drains.
    Py_AddPendingCall(&Released::DrainPending, this);
  }
  /// Requires: the interpreter's lock is held.
  void Drain()
  {
    std::vector<PyObject*> objects;
    {
      const std::lock_guard<std::mutex> lock(this->Mutex);
      objects.swap(this->Objects);
    }
    for (PyObject* object : objects)
    {
      Py_DECREF(object);
    }
  }

private:
  static int DrainPending(void* self)
  {
    static_cast<Released*>(self)->Drain();
    return 0;
  }

  std::mutex Mutex;
  std::vector<PyObject*> Objects;
};

Released& TheReleased()
{
  static Released* const released = new Released;
  return *released;
}

/// What was raised, as "ValueError: no such chunk"; clears it.
std::string TakeError()
{
  PyObject* type = nullptr;
  PyObject* value = nullptr;
  PyObject* trace = nullptr;
  PyErr_Fetch(&type, &value, &trace);
  PyErr_NormalizeException(&type, &value, &trace);
  std::string text = type ? reinterpret_cast<PyTypeObject*>(type)->tp_name : "unknown error";
  PyObject* message = value ? PyObject_Str(value) : nullptr;
  const char* utf8 = message ? PyUnicode_AsUTF8(message) : nullptr;
  if (utf8 && *utf8 != '\0')
  {
    text += std::string(": ") + utf8;
  }
  Py_XDECREF(message);
  Py_XDECREF(type);
  Py_XDECREF(value);
  Py_XDECREF(trace);
  PyErr_Clear();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// Calls a Python function to read a box.
class Reader
{
public:
  /// Requires: the interpreter's lock is held.
  Reader(PyObject* function, Py_ssize_t voxelBytes)
    : Function(function)
    , VoxelBytes(voxelBytes)
  {
    Py_INCREF(function);
  }
  ~Reader() { TheReleased().Add(this->Function); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  Reader(Reader&&) = delete;
  Reader& operator=(Reader&&) = delete;

  std::string Read(int level, const long long first[3], const long long size[3], void* voxels) const
  {
    if (!TheGate().Enter())
    {
      return "Python is shutting down.";
    }
    const PyGILState_STATE state = PyGILState_Ensure();
    TheReleased().Drain();
    std::string why = this->Call(level, first, size, voxels);
    PyGILState_Release(state);
    TheGate().Leave();
    return why;
  }

private:
  std::string Call(int level, const long long first[3], const long long size[3], void* voxels) const
  {
    PyObject* const view = PyMemoryView_FromMemory(static_cast<char*>(voxels),
      static_cast<Py_ssize_t>(size[0] * size[1] * size[2]) * this->VoxelBytes, PyBUF_WRITE);
    PyObject* const result = view ? PyObject_CallFunction(this->Function, "i(LLL)(LLL)O", level,
                                      first[2], first[1], first[0], size[2], size[1], size[0], view)
                                  : nullptr;
    std::string why = result ? std::string() : TakeError();
    Py_XDECREF(result);
    // The memory is gone soon: nobody may keep a way to it.
    PyObject* const released = view ? PyObject_CallMethod(view, "release", nullptr) : nullptr;
    if (!released && why.empty())
    {
      why = TakeError();
    }
    PyErr_Clear();
    Py_XDECREF(released);
    Py_XDECREF(view);
    return why;
  }

  PyObject* const Function;
  const Py_ssize_t VoxelBytes;
};

void* BeginWaiting()
{
  return Py_IsInitialized() && PyGILState_Check() ? PyEval_SaveThread() : nullptr;
}

void EndWaiting(void* state)
{
  if (state)
  {
    PyEval_RestoreThread(static_cast<PyThreadState*>(state));
  }
}

PyObject* SetReader(PyObject*, PyObject* args)
{
  PyObject* wrapped = nullptr;
  PyObject* function = nullptr;
  Py_ssize_t voxelBytes = 0;
  if (!PyArg_ParseTuple(args, "OOn", &wrapped, &function, &voxelBytes))
  {
    return nullptr;
  }
  auto* source = vtkCallbackVolumeSource::SafeDownCast(
    vtkPythonUtil::GetPointerFromObject(wrapped, "vtkCallbackVolumeSource"));
  if (!source)
  {
    return nullptr; // the exception is set
  }
  if (!PyCallable_Check(function) || voxelBytes < 1)
  {
    PyErr_SetString(PyExc_TypeError, "a function and the bytes of a voxel are needed");
    return nullptr;
  }
  auto reader = std::make_shared<const Reader>(function, voxelBytes);
  source->SetReadFunction([reader](int level, const long long first[3], const long long size[3],
                            void* voxels) { return reader->Read(level, first, size, voxels); });
  Py_RETURN_NONE;
}

PyObject* Close(PyObject*, PyObject*)
{
  Py_BEGIN_ALLOW_THREADS;
  TheGate().CloseAndWait();
  Py_END_ALLOW_THREADS;
  Py_RETURN_NONE;
}

PyMethodDef Methods[] = {
  { "set_reader", &SetReader, METH_VARARGS,
    "set_reader(source, function, voxel_bytes)\n\nLets a vtkCallbackVolumeSource read by "
    "function(level, first, size, view): first and size as (z, y, x), view a writable memoryview "
    "of the voxels, to be filled; not to be kept. Called from other threads. What it raises is the "
    "error of that brick." },
  { "close", &Close, METH_NOARGS,
    "close()\n\nWaits for the calls under way and lets none begin: for the end of the "
    "interpreter." },
  { nullptr, nullptr, 0, nullptr },
};

PyModuleDef Definition = { PyModuleDef_HEAD_INIT, "_callback",
  "Volumes whose bricks are read by Python code.", -1, Methods, nullptr, nullptr, nullptr,
  nullptr };

} // namespace

PyMODINIT_FUNC PyInit__callback()
{
  vtkCallbackVolumeSource::SetWaitFunctions(&BeginWaiting, &EndWaiting);
  return PyModule_Create(&Definition);
}
