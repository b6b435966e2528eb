"""The tests mirror the sources: each module has a test file of its own name, or is listed here under another one."""

from __future__ import annotations

from fnmatch import fnmatch
from pathlib import Path

TESTS = Path(__file__).parent
SOURCES = TESTS.parent / "src" / "seatruth"
MODULES = sorted(path.relative_to(SOURCES).as_posix() for path in SOURCES.rglob("*.py") if path.name != "__init__.py")

# Files that test modules under another name, with those modules (or a pattern of them). A module leaves the list once a
# file has its name.
ELSEWHERE = {
    # A list of types, nothing that runs.
    "test_layers.py": ("arrays",),
    # Every effect passes the same checks.
    "effects/test_effects_library.py": ("effects/*",),
    # Every figure is drawn with data and without.
    "report/test_report_figures.py": ("report/figures/*",),
    # Published numbers, tested with the model that takes them.
    "models/test_mmg.py": ("models/ship_parameters",),
    "models/test_models_glider.py": ("models/glider_parameters",),
    "models/test_rov.py": ("models/rov_parameters",),
    "models/test_models_torpedo.py": ("models/rigid_body", "models/torpedo_channels", "models/torpedo_parameters"),
    # Running, storing and resuming are one thing to a user.
    "comparison/test_comparison_runs.py": (
        "comparison/realisation",
        "comparison/results",
        "comparison/runner",
        "comparison/scoring",
        "comparison/store",
        "comparison/store_schema",
        "comparison/worker",
    ),
    # What a likelihood gives.
    "diagnosis/test_diagnosis_marginal_likelihood.py": ("diagnosis/unknowns",),
    # Sections are read on the page.
    "report/test_report_diagnosis.py": ("report/diagnosis/*", "report/text/diagnosis", "report/text/gap"),
    "report/test_report_page.py": (
        "report/sections/*",
        "report/blocks",
        "report/readings",
        "report/text/identification",
        "report/text/worries",
        "report/view",
    ),
    # Stages of `identify` and what they give.
    "test_identify.py": (
        "analysis",
        "estimate",
        "identification",
        "provenance",
        "uncertainty/cross_validation",
        "uncertainty/fit_table",
    ),
    # What a sample of the posterior says, tested by the samples.
    "uncertainty/test_uncertainty_posterior.py": ("statistics/posterior_sample",),
    # Stages of the compiler, tested by the expression that comes out.
    "simulate/test_simulate_compiler_trace.py": (
        "simulate/compiler/derivatives",
        "simulate/compiler/graph",
        "simulate/compiler/lowering",
        "simulate/compiler/node",
        "simulate/compiler/operations",
        "simulate/compiler/simplify",
    ),
    # Stages of the compiler, tested by the kernel that comes out.
    "simulate/test_simulate_compiler_cache.py": (
        "simulate/compiler/kernels",
        "simulate/compiler/llvm_ir",
        "simulate/compiler/machine_code",
    ),
    # What the derivatives are made of, tested by the derivatives.
    "simulate/test_simulate_compiler_sensitivities.py": ("simulate/compiler/propagation", "simulate/compiler/system"),
    # What a model declares, tested where a simulation takes it.
    "simulate/test_simulate_first_slope.py": ("models/first_slope",),
    # Stages of the simulation, tested by its outputs.
    "simulate/test_simulate_compiled.py": ("simulate/base", "simulate/rhs"),
    # A user's simulator, run one call after another.
    "simulate/test_simulate_blackbox.py": ("simulate/serial",),
    # Suites for others are tested by the classes that inherit them.
    "effects/test_effects_installed.py": ("effects/base", "effects/noise", "testing/effects"),
    "models/test_model_conformance.py": ("testing/models",),
    "optimizers/test_conformance.py": ("optimizers/chain", "testing/optimizers", "testing/problems"),
    # The measures of a comparison are tested against known distributions, whatever module computes them.
    "comparison/test_comparison_measures.py": (
        "comparison/estimation",
        "comparison/noise",
        "comparison/optimisation",
        "comparison/ranks",
    ),
    # What a command does is tested as a user calls it; errors by what it then says.
    "test_cli.py": ("commands/*", "__main__", "errors"),
    "test_init_command.py": ("commands/init",),
    "test_list_command.py": ("commands/list_installed",),
    "test_predict_command.py": ("commands/predict",),
    # What is asked, read and found, tested by what is predicted.
    "prediction/test_prediction_pipeline.py": (
        "prediction/conditions",
        "prediction/findings",
        "prediction/measured",
        "prediction/quantities",
        "prediction/results",
    ),
    # Steps of one calculation, tested by its result.
    "comparison/test_comparison_file.py": (
        "commands/compare",
        "comparison/problem",
        "comparison/spec",
        "comparison/text",
        "report/comparison",
    ),
    "costs/test_costs_formula.py": ("models/formula", "study/table"),
    "costs/test_costs_parameter_space.py": ("models/parameter",),
    "costs/test_costs_regression.py": ("costs/finite_differences", "costs/linear"),
    "costs/test_costs_problem.py": (
        "costs/base",
        "costs/content",
        "costs/registry",
        "costs/study_cost",
        "study/study",
    ),
    "costs/test_costs_trajectory.py": ("costs/initial", "costs/open_loop", "costs/segments"),
    # Stages of the search, tested by the hypotheses that it fits.
    "diagnosis/test_diagnosis_search.py": (
        "diagnosis/hypotheses",
        "diagnosis/noise_sharing",
    ),
    "diagnosis/test_diagnosis_sizes.py": ("diagnosis/size_search",),
    # What the tables of a diagnosis are made of.
    "diagnosis/test_diagnosis_assembly.py": ("diagnosis/information",),
    # Sentences of the headline.
    "diagnosis/test_diagnosis_sentences.py": ("diagnosis/look_alikes",),
    # The layout of diagnosis.json, tested by what is saved and loaded.
    "diagnosis/test_diagnosis_results.py": ("diagnosis/parts", "diagnosis/verdict"),
    "diagnosis/test_diagnose_command.py": ("commands/diagnose", "study/augment"),
    "effects/test_effects_physics.py": ("effects/channel_aliases", "effects/kinematics"),
    "manoeuvres/test_manoeuvres.py": (
        "manoeuvres/crossings",
        "manoeuvres/figures",
        "manoeuvres/gliding",
        "manoeuvres/plans",
        "manoeuvres/run",
        "manoeuvres/stepper",
    ),
    "models/test_observed.py": ("models/initial_motion",),
    "models/test_model_laws.py": ("models/base", "models/geometry"),
    "models/test_model_registry.py": ("models/registry", "models/user_file", "plugins"),
    "optimizers/test_checkpoint.py": ("optimizers/journal",),
    "optimizers/test_driver.py": ("optimizers/base", "optimizers/budget", "optimizers/evaluator", "optimizers/problem"),
    # Recognising a file, and what a log then is to a study.
    "readers/test_readers_read.py": (
        "readers/base",
        "readers/headers",
        "readers/listing",
        "readers/log",
        "readers/registry",
        "readers/rows",
        "readers/tables",
    ),
    "readers/test_readers_csv_file.py": ("readers/csv_dialect", "readers/csv_fields"),
    # Each is tested with a file that the format's own library wrote.
    "readers/test_readers_formats.py": (
        "readers/dataflash",
        "readers/excel",
        "readers/hdf5",
        "readers/matlab",
        "readers/mcap_file",
        "readers/parquet",
        "readers/ros_messages",
        "readers/rosbag",
        "readers/ulog",
        "readers/vectors",
        "testing/readers",
    ),
    "readers/test_readers_isolation.py": ("readers/child",),
    "test_workers.py": ("worker_child",),
    "storage/test_storage_kept_runs.py": ("storage/cache_folder",),
    # What an FMU says and does is read from the model that it becomes.
    "models/test_models_fmu.py": ("models/fmu_description", "models/fmu_simulation"),
    "study/test_study_simulators.py": ("commands/cost_notice", "cost_forecast", "study/template_simulator"),
    "diagnosis/test_diagnosis_few_runs.py": ("diagnosis/discrepancy/black_box", "simulate/meter"),
    "diagnosis/test_diagnosis_problem.py": ("diagnosis/usual_sizes",),
    "readers/test_readers_nmea.py": ("readers/nmea_clock", "readers/nmea_sentences"),
    "sample/test_sample.py": ("sample/make",),
    "storage/test_storage_checkpoint.py": ("storage/checksum", "storage/lock"),
    "study/test_study_expressions.py": ("study/validation",),
    "study/test_study_parse.py": ("study/reference", "study/schema", "study/schema_base", "study/schema_trials"),
    "study/test_study_parts.py": (
        "study/build",
        "study/load",
        "study/noise",
        "study/parameters",
        "study/solver",
        "study/fields",
        "study/template",
    ),
    "test_end_to_end.py": ("commands/demo",),
    "manoeuvres/test_manoeuvres_recognise.py": ("manoeuvres/recording", "manoeuvres/slowing"),
    "study/test_study_infer_columns.py": ("study/column_names",),
    "test_trials_command.py": ("study/log", "study/trial_tables", "report/log_map"),
    "test_identify_interrupts.py": ("uncertainty/refits",),
    "trials/test_trials_frames.py": ("trials/attitude", "trials/geodesy"),
    "trials/test_trials_time_axis.py": ("trials/dates",),
    "trials/test_trials_check.py": (
        "trials/check/duplicates",
        "trials/check/excitation",
        "trials/check/frozen",
        "trials/check/helpers",
        "trials/check/limits",
        "trials/check/positions",
        "trials/check/rates",
        "trials/check/sensors",
        "trials/check/steering",
        "trials/check/table",
        "trials/check/timing",
    ),
    "trials/test_trials_prepare.py": (
        "trials/prepare/base",
        "trials/prepare/decimate",
        "trials/prepare/filters",
        "trials/prepare/fusion",
        "trials/prepare/lever_arm",
        "trials/prepare/simple",
    ),
    "trials/test_trials_read.py": (
        "trials/channel",
        "trials/columns",
        "trials/finding",
        "trials/places",
        "trials/standard_channels",
    ),
    "uncertainty/test_formula_uncertainty.py": (
        "uncertainty/model_comparison",
        "uncertainty/prediction",
        "uncertainty/structural_identifiability",
    ),
    "uncertainty/test_identifiability.py": (
        "uncertainty/covariance",
        "uncertainty/prior_identifiability",
        "uncertainty/sensitivity",
    ),
}


def own_files(module: str) -> list[Path]:
    """Test files whose name is the module's path or the end of it: a/b.py has test_a_b.py or test_b.py."""
    parts = module.removesuffix(".py").split("/")
    names = {"test_" + "_".join(parts[k:]) + ".py" for k in range(len(parts))}
    return [path for path in (TESTS / parts[0] if len(parts) > 1 else TESTS).rglob("test_*.py") if path.name in names]


def other_files(module: str) -> list[Path]:
    """Test files that the list names for it and that are there."""
    name = module.removesuffix(".py")
    listed = [file for file, patterns in ELSEWHERE.items() if any(fnmatch(name, pattern) for pattern in patterns)]
    return [TESTS / file for file in listed if (TESTS / file).exists()]


def test_each_module_has_its_test_file() -> None:
    missing = [module for module in MODULES if not own_files(module) and not other_files(module)]
    assert not missing, "no test file is named after these modules, nor listed for them in ELSEWHERE"
