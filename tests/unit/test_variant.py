"""The choice of the renderer's variant, with libraries that are missing or broken."""

import builtins
import os
import subprocess
import sys

import pytest

from render import variant
from scenes import InvalidInput


@pytest.fixture(autouse=True)
def _fresh(monkeypatch):
    monkeypatch.delenv(variant.OVERRIDE, raising=False)
    variant.choose.cache_clear()
    yield
    variant.choose.cache_clear()


def test_missing_library_means_scalar_without_a_trial(monkeypatch, tmp_path):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "none.so"))
    monkeypatch.setattr(variant, "_PROBE", "pass")  # a trial would succeed
    assert variant.choose() == variant.SCALAR


def test_library_by_its_name_alone_is_tried(monkeypatch):
    """The loader of libraries finds it where it looks."""
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "libLLVM.so")
    monkeypatch.setattr(variant, "_PROBE", "pass")
    assert variant.choose() == variant.LLVM


def test_file_that_is_no_library_means_scalar(monkeypatch, tmp_path):
    (tmp_path / "libLLVM.so").write_bytes(b"not a library")
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "libLLVM.so"))
    assert variant.choose() == variant.SCALAR


def test_library_that_aborts_the_process_means_scalar(monkeypatch, tmp_path):
    """What LLVM 15 does: the probing process dies by a signal, and nothing of it reaches this one."""
    monkeypatch.setattr(variant, "_PROBE", "import os; os.abort()")
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path))
    assert variant.choose() == variant.SCALAR


def test_newest_library_that_works_is_taken(monkeypatch):
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    monkeypatch.setattr(variant, "_candidates", lambda: ["/llvm/20", "/llvm/19", "/llvm/18"])
    monkeypatch.setattr(variant, "_works", lambda library: library != "/llvm/20")
    assert variant.choose() == variant.LLVM
    assert os.environ.pop("DRJIT_LIBLLVM_PATH") == "/llvm/19"


def test_releases_are_compared_as_numbers():
    paths = ["/usr/lib/libLLVM-9.so.1", "/usr/lib/libLLVM.so.19.1", "/usr/lib/libLLVM-14.so"]
    assert max(paths, key=variant._release) == "/usr/lib/libLLVM.so.19.1"


def test_cuda_is_taken_only_by_its_name(monkeypatch):
    """Whatever works here: a limb was wrong with it."""
    monkeypatch.setattr(variant, "_runs", lambda *program: True)
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "libLLVM.so")
    assert variant.choose() == variant.LLVM
    variant.choose.cache_clear()
    monkeypatch.setenv(variant.OVERRIDE, variant.CUDA)
    assert variant.choose() == variant.CUDA


def test_override(monkeypatch):
    monkeypatch.setenv(variant.OVERRIDE, "anything")
    assert variant.choose() == "anything"
    with pytest.raises(InvalidInput, match=r"ICE_VARIANT must be one of scalar_rgb, .*, got 'anything'"):
        variant.use("anything")


def test_planner_and_measure_load_without_the_renderer():
    code = "import sys, planner, measure; sys.exit('mitsuba' in sys.modules or 'drjit' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
    code = "import sys, planner; sys.exit('cv2' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_a_missing_library_of_the_system_is_named_in_one_line(monkeypatch):
    """As Dr.Jit does it: a NameError about itself while an ImportError is handled."""

    def load(name, *rest):
        if name == "mitsuba":
            try:
                raise ImportError("libatomic.so.1: cannot open shared object file")
            except ImportError:
                raise NameError("name '_drjit_ext' is not defined")  # noqa: B904
        return real(name, *rest)

    real = builtins.__import__
    monkeypatch.setattr(builtins, "__import__", load)
    with pytest.raises(InvalidInput, match=r"mitsuba must be loadable, got libatomic\.so\.1: cannot open"):
        variant.use("scalar_rgb")
