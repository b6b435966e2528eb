"""Statistics that several packages use: noise models and rank tests. It knows nothing of models, trials or costs."""
