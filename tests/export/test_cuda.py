"""CUDA's kernels, run on the processor thread by thread, and compiled by nvcc if it is installed."""

import json
import os
import re
import shutil
import subprocess
from itertools import product
from pathlib import Path
from typing import Any

import pytest

import urdfkin
from scripts import benchmark_gpu
from tests.export.writing import ALL, code, file
from tests.laws.subjects import robot_of
from urdfkin.export import check as checking
from urdfkin.export import write
from urdfkin.export.check import check

#: Folder with a `cuda_runtime.h` for the processor
_SHIM = Path(__file__).parent
_COMPILER = benchmark_gpu.find_nvcc()
_NVCC = pytest.mark.skipif(_COMPILER is None, reason="no nvcc; `make nvcc` installs it")


@pytest.fixture
def nvcc(monkeypatch: pytest.MonkeyPatch) -> str:
    """Put CUDA's compiler on the PATH."""
    assert _COMPILER is not None
    monkeypatch.setenv("PATH", f"{Path(_COMPILER).parent}{os.pathsep}{os.environ['PATH']}")
    return _COMPILER


def ran(path: Path, *options: str, status: int = 0) -> str:
    """Compile a file with warnings as errors, run its kernels on the processor, and return the output."""
    if shutil.which("g++") is None:
        pytest.skip("no g++")
    strict = ["-Wall", "-Wextra", "-Werror", "-Wno-unknown-pragmas", "-fno-sanitize-recover=all"]
    built = path.with_suffix(".out")
    language = ["-std=c++20", "-O1", "-g", "-D__CUDACC__", f"-I{_SHIM}"]
    command = ["g++", *language, *strict, *options, "-x", "c++", str(path), "-o", str(built)]
    subprocess.run(command, check=True)
    done = subprocess.run([str(built)], capture_output=True, text=True, check=False)
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout


@pytest.mark.long
@pytest.mark.parametrize("sanitizer", ["address,undefined", "thread"])
@pytest.mark.parametrize("real", ["double", "float"])
def test_kernels_compute_true_values_and_touch_only_their_memory(
    real: str, sanitizer: str, tmp_path: Path
) -> None:
    written = code(urdfkin.load("ur5"), quantities=("placement", "jacobian", "acceleration"))
    path = file(written, "cuda", tmp_path)
    name = path.stem.upper()
    said = ran(path, f"-fsanitize={sanitizer}", f"-D{name}_MAIN", f"-D{name}_REAL={real}")
    assert len(re.findall(r"^good \w+: 4 test vectors", said, re.MULTILINE)) == 3
    assert len(re.findall(r"^good \w+ on the GPU: 4 test vectors", said, re.MULTILINE)) == 3
    assert "WRONG" not in said


@pytest.mark.long
@pytest.mark.parametrize("robot", ["planar_two_link", "planar_and_floating_in_the_middle", "single_link"])
def test_kernels_of_wide_rows_and_of_other_joints_compute_true_values(robot: str, tmp_path: Path) -> None:
    subject = urdfkin.load(robot) if robot == "planar_two_link" else robot_of(robot)
    some = {"planar_two_link": ALL, "single_link": ("placement",)}
    quantities = some.get(robot, ("placement", "jacobian", "acceleration"))
    path = file(code(subject, quantities=quantities), "cuda", tmp_path)
    said = ran(path, "-fsanitize=address,undefined", f"-D{path.stem.upper()}_MAIN")
    assert said.count("good ") == 2 * len(quantities)


@pytest.mark.long
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("? tile.row[lane][k] : T(0.0)", "? tile.row[0][k] : T(0.0)"),
        ("tile.row[lane][k] = own[first + k]", "tile.row[lane][k] = own[k]"),
        ("WIDTH + first + i % piece] = tile", "WIDTH + i % piece] = tile"),
        ("blockIdx.x) * THREADS + threadIdx.x / WARP * WARP", "blockIdx.x) * THREADS"),
        ("return cudaLaunchKernel(", "return 1 + cudaLaunchKernel("),
        ("results);\n        write_rows", "results); results[7] *= T(1.0001);\n        write_rows"),
    ],
)
def test_a_changed_kernel_fails_only_the_check_on_the_gpu(right: str, wrong: str, tmp_path: Path) -> None:
    path = file(code(urdfkin.load("ur5"), quantities=("jacobian",)), "cuda", tmp_path)
    text = path.read_text("utf-8")
    assert text.count(right) == 1
    path.write_text(text.replace(right, wrong), "utf-8")
    said = ran(path, f"-D{path.stem.upper()}_MAIN", status=1)
    assert re.search(r"^good jacobian: ", said, re.MULTILINE)
    assert re.search(r"^WRONG jacobian on the GPU: ", said, re.MULTILINE)


_SIZES = """
#include "{file}"
#include <cstdio>
int main()
{{
    const size_t sizes[] = {{0, 1, 31, 32, 33, 127, 128, 129, 255, 256, 257, 600}};
    for (size_t n : sizes) {{
        std::vector<float> q(n * 6), out(n * 36);
        for (size_t i = 0; i < q.size(); ++i) q[i] = 0.01f * static_cast<float>(i % 613);
        if ({name}_jacobian_float(n, q.data(), out.data(), nullptr) != 0) return 1;
        for (size_t k = 0; k < n; ++k) {{
            float one[36];
            {name}_kinematics::jacobian(q.data() + 6 * k, one);
            for (int i = 0; i < 36; ++i)
                if (!(one[i] == out[36 * k + i])) return std::printf("%zu %zu %d\\n", n, k, i), 1;
        }}
    }}
}}
"""


@pytest.mark.slow
@pytest.mark.parametrize("blocks", ["1u << 20", "2"])
def test_a_batch_of_any_size_gives_the_results_of_single_configurations_bit_for_bit(
    blocks: str, tmp_path: Path
) -> None:
    path = file(code(urdfkin.load("ur5"), quantities=("jacobian",)), "cuda", tmp_path)
    text = path.read_text("utf-8")
    assert text.count("MOST_BLOCKS = 1u << 20;") == 1
    # With two blocks, a thread of the larger batches has several configurations.
    path.write_text(text.replace("MOST_BLOCKS = 1u << 20;", f"MOST_BLOCKS = {blocks};"), "utf-8")
    program = tmp_path / "sizes.cpp"
    program.write_text(_SIZES.format(file=path.name, name=path.stem), "utf-8")
    ran(program, "-fsanitize=address,undefined", f"-D{path.stem.upper()}_ENTRY_POINTS", f"-I{tmp_path}")


@_NVCC
@pytest.mark.long
@pytest.mark.parametrize("real", ["double", "float"])
def test_cudas_compiler_compiles_an_exported_file_without_a_warning(
    nvcc: str, real: str, tmp_path: Path
) -> None:
    path = file(code(urdfkin.load("ur5"), quantities=("placement", "acceleration")), "cuda", tmp_path)
    name, built = path.stem.upper(), tmp_path / "check"
    macros = [f"-D{name}_MAIN", f"-D{name}_REAL={real}"]
    strict = ["-Xcompiler", "-Wall,-Wextra,-Werror", "-Werror", "all-warnings"]
    subprocess.run([nvcc, *strict, *macros, "-x", "cu", str(path), "-o", str(built)], check=True)
    said = subprocess.run([str(built)], capture_output=True, text=True, check=True).stdout
    assert said.count("good ") >= 2  # without a GPU, only the functions of the host
    assert "WRONG" not in said


@pytest.mark.slow
def test_the_benchmarks_program_prints_a_time_of_each_quantity_precision_and_batch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(benchmark_gpu, "SIZES", (1, 40))
    written = code(urdfkin.load("planar_two_link"), quantities=("jacobian", "acceleration"))
    file(written, "cuda", tmp_path)
    program = tmp_path / "measure.cpp"
    text = benchmark_gpu.make_program(written)
    assert "@" not in text
    program.write_text(text.replace("(1) << 28", "(1) << 16"), "utf-8")
    lines = ran(program, "-fsanitize=address,undefined", f"-I{tmp_path}").splitlines()
    measured = list(benchmark_gpu.make_rows(written, lines))
    found = [(x["real"], x["n"], x["quantity"]) for x in measured]
    assert sorted(found) == sorted(product(("double", "float"), (1, 40), ("jacobian", "acceleration")))
    assert all(x["a_second"] > 0.0 and x["share"] > 0.0 for x in measured)
    assert benchmark_gpu.make_table(measured).count("\n") == 1 + len(measured)


def test_the_fraction_of_the_bandwidth_counts_the_bytes_of_inputs_and_results() -> None:
    written = code(urdfkin.load("planar_two_link"), quantities=("jacobian", "acceleration"))
    jacobian, acceleration = written.functions
    assert benchmark_gpu.bytes_per_configuration(written, jacobian, "double") == 8 * (2 + 12)
    assert benchmark_gpu.bytes_per_configuration(written, acceleration, "float") == 4 * (3 * 2 + 6)
    row = {"by": "urdfkin", "quantity": "jacobian", "real": "double", "n": 1000, "s": 1e-3}
    (found,) = benchmark_gpu.make_rows(written, [json.dumps({"bandwidth": 1.12e9}), json.dumps(row)])
    assert found["a_second"] == pytest.approx(1e6)
    assert found["share"] == pytest.approx(0.1)
    with pytest.raises(ValueError, match="did not print the bandwidth"):
        list(benchmark_gpu.make_rows(written, [json.dumps(row)]))


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [None, "export", "PyTorch Kinematics"])
def test_the_benchmark_measures_libraries_of_pytorch_after_a_check(
    wrong: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    torch: Any = pytest.importorskip("torch")
    pytest.importorskip("pytorch_kinematics")
    monkeypatch.setattr(benchmark_gpu, "SIZES", (1, 3))
    monkeypatch.setattr(benchmark_gpu, "LAUNCHES", 1)
    monkeypatch.setattr(torch, "compile", lambda function: function)
    robot = urdfkin.load("planar_two_link")
    written = code(robot, quantities=("placement", "jacobian"))
    if wrong == "export":
        text = write(written, "torch").replace("0.4", "0.41", 1)
        monkeypatch.setattr(benchmark_gpu, "write", lambda code, to: text)
    elif wrong:
        monkeypatch.setattr(benchmark_gpu, "find_indices", lambda ours, theirs: [1, 0])
    found = benchmark_gpu.measure_torch(robot, "tip", written, "cpu")
    if wrong:
        with pytest.raises(ValueError, match=wrong):
            list(found)
        return
    rows = list(benchmark_gpu.make_rows(written, [json.dumps({"bandwidth": 1e9}), *found]))
    by = [(name, who) for name in ("placement", "jacobian") for who in ("PyTorch", "torch.compile")]
    expected = product([*by, ("jacobian", "PyTorch Kinematics")], ("double", "float"), (1, 3))
    assert [((x["quantity"], x["by"]), x["real"], x["n"]) for x in rows] == list(expected)


@pytest.mark.parametrize(
    ("compiler", "said"), [(None, "nvcc is not installed"), ("/bin/false", "CUDA's driver finds no GPU here")]
)
def test_the_benchmark_refuses_a_machine_without_compiler_or_gpu(
    compiler: str | None, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(benchmark_gpu, "find_nvcc", lambda: compiler)
    monkeypatch.setattr(benchmark_gpu, "count_gpus", lambda: 0)
    assert benchmark_gpu.main(["planar_two_link"]) == 2
    assert said in capsys.readouterr().err


@_NVCC
@pytest.mark.long
def test_cudas_compiler_compiles_the_benchmark(capsys: pytest.CaptureFixture[str]) -> None:
    assert benchmark_gpu.main(["planar_two_link", "--compile-only"]) == 0
    assert capsys.readouterr().out == "compiled, not run: measure, double, float\n"


@_NVCC
@pytest.mark.long
@pytest.mark.usefixtures("nvcc")
def test_the_check_uses_cudas_compiler_if_a_gpu_is_present(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checking, "_has_gpu", lambda: True)
    found = check(file(code(urdfkin.load("ur5"), quantities=("placement",)), "cuda", tmp_path))
    assert found.passed
    assert len(found.lines) >= 2


@_NVCC
@pytest.mark.long
@pytest.mark.usefixtures("nvcc")
@pytest.mark.skipif(shutil.which("cmake") is None, reason="no cmake")
def test_the_cmake_lines_of_an_exported_file_build_a_library_for_a_c_program(tmp_path: Path) -> None:
    path = file(code(urdfkin.load("ur5"), quantities=("jacobian",)), "cuda", tmp_path)
    name = path.stem
    lines = path.read_text("utf-8").partition(" * CMake:")[2].partition(" */")[0].splitlines()
    example = "\n".join(line.lstrip(" *") for line in lines)
    assert f"add_library({name}" in example
    (tmp_path / "main.c").write_text(
        f'#define {name.upper()}_DECLARATIONS\n#include "{path.name}"\n'
        f"int main(void) {{ return {name}_jacobian_double(0, 0, 0, 0); }}\n",
        "utf-8",
    )
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.18)\nproject(example LANGUAGES C CXX)\n"
        f"{example}\nadd_executable(main main.c)\ntarget_link_libraries(main {name})\n",
        "utf-8",
    )
    built = tmp_path / "built"
    subprocess.run(["cmake", "-S", str(tmp_path), "-B", str(built)], check=True, capture_output=True)
    subprocess.run(["cmake", "--build", str(built)], check=True, capture_output=True)
    assert subprocess.run([str(built / "main")], check=False).returncode == 0
