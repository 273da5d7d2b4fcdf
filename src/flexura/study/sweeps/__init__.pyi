from flexura.study.sweeps.sweep import sweep as sweep
