"""What practitioners use to find a model's fault, beside `mu_addon.evidence`."""
